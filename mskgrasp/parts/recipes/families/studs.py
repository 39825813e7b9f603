"""Standoffs, studs and levelling feet; threads are cylinders of the nominal diameter."""

from __future__ import annotations

from collections.abc import Iterator

from mskgrasp.parts.recipes.families import forms as f
from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.listing import BRASS, POLYAMIDE, one_per_row
from mskgrasp.parts.recipes.recipe import ALUMINIUM, Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s


def recipes() -> Iterator[Recipe]:
    """The built-in standoffs, studs and feet; sizes are within the range of catalogues."""
    yield from one_per_row("standoff_mf.csv", "standoff_mf_m{d}x{l}", standoff_mf, density=BRASS)
    yield from one_per_row("standoff_ff.csv", "standoff_ff_m{d}x{l}", standoff_ff, density=ALUMINIUM)
    yield from one_per_row("round_standoff.csv", "round_standoff_{D}x{l}", round_standoff, density=ALUMINIUM)
    yield from one_per_row("plastic_pillar.csv", "plastic_pillar_{D}x{l}", plastic_pillar, density=POLYAMIDE)
    yield from one_per_row("hex_stud.csv", "hex_stud_m{d}x{l}", hex_stud)
    yield from one_per_row("waisted_stud.csv", "waisted_stud_m{d}x{l}", waisted_stud)
    yield from one_per_row("levelling_foot.csv", "levelling_foot_{D}xm{d}x{l}", levelling_foot)
    yield from one_per_row("locking_foot.csv", "locking_foot_{a}xm{d}x{l}", locking_foot)


def standoff_mf(size: dict[str, float]) -> s.Solid:
    """A hexagon with a thread in the lower end and a stud on the upper one."""
    width, length, depth = size["s_mm"], size["l_mm"], size["depth_mm"]
    lower = f.hex_ring(width, size["d1_mm"] / 2, 0, depth)
    stud = f.shank(size["d_mm"], length, length + size["stud_mm"])
    return (lower + h.hexagon_bar(width, depth, length) + stud).solid()


def standoff_ff(size: dict[str, float]) -> s.Solid:
    """A hexagon with a thread in either end."""
    width, length, depth, r = size["s_mm"], size["l_mm"], size["depth_mm"], size["d1_mm"] / 2
    ends = f.hex_ring(width, r, 0, depth) + f.hex_ring(width, r, length - depth, length)
    return (ends + h.hexagon_bar(width, depth, length - depth)).solid()


def round_standoff(size: dict[str, float]) -> s.Solid:
    """A round pillar with two flats for a spanner near its foot and a stud on top."""
    radius, length, across = size["D_mm"] / 2, size["l_mm"], size["s_mm"] / 2
    low, high = 5.0, 5.0 + 0.5 * size["D_mm"]
    waist = h.cylinder(radius, low, high)
    for side in (1, -1):
        near, far = sorted((side * across, side * (radius + 1)))
        waist -= h.block(-radius - 1, radius + 1, near, far, low, high)
    pillar = h.cylinder(radius, 0, low) + waist + h.cylinder(radius, high, length)
    return (pillar + f.shank(size["d_mm"], length, length + size["stud_mm"])).solid()


def plastic_pillar(size: dict[str, float]) -> s.Solid:
    """A moulded pillar: a broad foot, a tapering shaft with four ribs, a pin."""
    radius, length, base, rib = size["D_mm"] / 2, size["l_mm"], size["base_mm"] / 2, size["rib_mm"] / 2
    profile = [(0, 0), (base, 0), (base, 4), (radius, 4), (0.85 * radius, length), (0, length)]
    pillar = h.turned(profile) + f.shank(size["pin_mm"], length, length + 1.5 * size["pin_mm"])
    fin = o.along_y([(0, 4), (base - 1, 4), (0.7 * radius, 0.8 * length), (0, 0.8 * length)], -rib, rib)
    for degrees in (0, 90, 180, 270):
        pillar += fin.turned("z", degrees)
    return pillar.solid()


def hex_stud(size: dict[str, float]) -> s.Solid:
    """A stud with a hexagon in the middle to drive it by."""
    k, length = size["k_mm"] / 2, size["l_mm"]
    end = f.shank(size["d_mm"], k, length / 2)
    return (h.hexagon_bar(size["s_mm"], -k, k) + end + end.mirrored("z")).solid()


def waisted_stud(size: dict[str, float]) -> s.Solid:
    """A stud whose shank is thinner than its threads, with cones between them."""
    r, waist, half = size["d_mm"] / 2, size["waist_mm"] / 2, size["l_mm"] / 2
    start, chamfer = half - size["b_mm"], 0.2 * r
    upper = [(waist, start - (r - waist)), (r, start), (r, half - chamfer), (r - chamfer, half), (0, half)]
    lower = [(radius, -z) for radius, z in upper[::-1]]
    return h.turned([*lower, *upper]).solid()


def levelling_foot(size: dict[str, float]) -> s.Solid:
    """A plate with a hub, a ball joint, a spindle with a hexagon at its lower end."""
    radius, edge, hub, top = size["D_mm"] / 2, size["t_mm"], size["hub_mm"] / 2, size["hub_height_mm"]
    foot = h.turned([(0, 0), (radius, 0), (radius, edge), (hub, 0.55 * top), (0.85 * hub, top), (0, top)])
    low = top + 0.2 * size["d_mm"]
    neck = h.cylinder(0.4 * size["d_mm"], top, low)
    bolt = h.hexagon_bar(size["s_mm"], low, low + 0.5 * size["d_mm"])
    return (foot + neck + bolt + f.shank(size["d_mm"], low, size["l_mm"])).solid()


def locking_foot(size: dict[str, float]) -> s.Solid:
    """An oblong foot with two bolt holes, a hub, and a spindle that carries a lock nut."""
    half, width, edge, d = size["a_mm"] / 2, size["b_mm"] / 2, size["t_mm"], size["d_mm"]
    outline = o.belt((width - half, 0, width), (half - width, 0, width))
    holes = [(sign * (half - width), 0, size["hole_mm"] / 2) for sign in (1, -1)]
    foot = h.plate(outline, 0, edge, holes)
    hub = h.turned(
        [(0, 0), (0.9 * width, 0), (0.9 * width, edge), (0.6 * width, 2.5 * edge), (0, 2.5 * edge)]
    )
    nut = size["nut_mm"]
    return (
        foot + hub + h.hexagon_bar(size["s_mm"], nut, nut + 0.8 * d) + f.shank(d, edge, size["l_mm"])
    ).solid()
