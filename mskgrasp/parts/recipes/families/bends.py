"""Bent round bar: U-bolts, hook bolts, S-hooks and hooks; threads are cylinders of the bar's diameter."""

from __future__ import annotations

from collections.abc import Iterator

from mskgrasp.parts.recipes.families import forms as f
from mskgrasp.parts.recipes.families.listing import OWN, one_per_row
from mskgrasp.parts.recipes.recipe import Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s


def recipes() -> Iterator[Recipe]:
    """The built-in parts bent from bar; sizes are within the range of catalogues."""
    yield from one_per_row("u_bolt.csv", "u_bolt_m{d}x{w}x{l}", u_bolt, source=f"{OWN}, like DIN 3570")
    yield from one_per_row("u_bolt_nuts.csv", "u_bolt_nuts_m{d}x{w}x{l}", u_bolt_nuts)
    yield from one_per_row("square_u_bolt.csv", "square_u_bolt_m{d}x{w}x{l}", square_u_bolt)
    yield from one_per_row("j_bolt.csv", "j_bolt_m{d}x{l}", j_bolt)
    yield from one_per_row("l_bolt.csv", "l_bolt_m{d}x{l}", l_bolt)
    yield from one_per_row("s_hook.csv", "s_hook_{d}x{r}", s_hook)
    yield from one_per_row("screw_hook.csv", "screw_hook_m{d}x{r}", screw_hook)
    yield from one_per_row("eye_hook.csv", "eye_hook_{d}x{r}", eye_hook)


def u_bolt(size: dict[str, float]) -> s.Solid:
    """Two threaded legs and a half circle between them."""
    return _u(size).solid()


def u_bolt_nuts(size: dict[str, float]) -> s.Solid:
    """A U-bolt with a nut on each leg and the strap between its legs."""
    r, half, at = size["d_mm"] / 2, (size["w_mm"] + size["d_mm"]) / 2, size["strap_mm"]
    t, wide = size["t_mm"], 1.15 * size["d_mm"]
    reach = half + wide
    strap = h.block(at, at + t, -reach, reach, -wide, wide)
    nut = h.hexagon_bar(size["s_mm"], 0, 1.6 * r).turned("y", -90).moved(x=at)
    return (_u(size) + strap + nut.moved(y=half) + nut.moved(y=-half)).solid()


def _u(size: dict[str, float]) -> h.Shape:
    """Legs along x from x = 0, the bend at the far end; symmetric about y = 0."""
    r, half = size["d_mm"] / 2, (size["w_mm"] + size["d_mm"]) / 2
    leg = size["l_mm"] - half - r
    return f.bent_rod(r, leg, (half, 180.0), leg, chamfer=0.2 * r).moved(y=-half)


def square_u_bolt(size: dict[str, float]) -> s.Solid:
    """Two threaded legs and a straight bridge with rounded corners."""
    r, half, bend = size["d_mm"] / 2, (size["w_mm"] + size["d_mm"]) / 2, size["bend_mm"]
    leg = size["l_mm"] - r - bend
    bridge = 2 * (half - bend)
    return f.bent_rod(r, leg, (bend, 90.0), bridge, (bend, 90.0), leg, chamfer=0.2 * r).solid()


def j_bolt(size: dict[str, float]) -> s.Solid:
    """A threaded shank that ends in a half circle."""
    r = size["d_mm"] / 2
    return f.bent_rod(r, size["l_mm"], (size["r_mm"], 180.0), size["tip_mm"], chamfer=0.2 * r).solid()


def l_bolt(size: dict[str, float]) -> s.Solid:
    """A threaded shank with a foot at right angles."""
    r = size["d_mm"] / 2
    return f.bent_rod(r, size["l_mm"], (size["r_mm"], 90.0), size["tip_mm"], chamfer=0.2 * r).solid()


def s_hook(size: dict[str, float]) -> s.Solid:
    """Two open bends, one to either side."""
    bend, turn = size["r_mm"], size["turn_deg"]
    middle = size["middle_mm"]
    return f.bent_rod(size["d_mm"] / 2, (bend, turn), middle, (bend, -turn), chamfer=0.5).solid()


def screw_hook(size: dict[str, float]) -> s.Solid:
    """A threaded shank with a collar, then a hook that tapers towards its tip."""
    d, bend = size["d_mm"], size["r_mm"]
    shank = f.shank(d, 0, size["l_mm"]).turned("y", -90)
    collar = h.cylinder(1.1 * d, 0, 0.4 * d).turned("y", 90)
    return (shank + collar + _hook(0.55 * d, bend)).solid()


def eye_hook(size: dict[str, float]) -> s.Solid:
    """A ring to hang from, then a hook that tapers towards its tip."""
    r, eye = size["d_mm"] / 2, size["eye_mm"] / 2
    return (f.torus(eye + r, r).moved(x=-eye - r) + _hook(1.15 * r, size["r_mm"])).solid()


def _hook(rod: float, bend: float) -> h.Shape:
    """From the origin along x: a short neck, a bend to the right, then most of a circle to the left."""
    return f.bent_rod(
        rod, 0.6 * bend, (0.8 * bend, -50.0), (bend, 250.0), end_radius=0.7 * rod, chamfer=0.3 * rod
    )
