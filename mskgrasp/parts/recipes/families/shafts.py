"""Shafts: turned seats on one axis, with milled and drilled features."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely
from manifold3d import Manifold

from mskgrasp.parts.recipes.families.listing import one_per_row
from mskgrasp.parts.recipes.recipe import Recipe
from mskgrasp.parts.solids import shape as sh
from mskgrasp.parts.solids import solid as s

CHAMFER = 1.0
"""Chamfer of both ends, at 45 degrees."""


def recipes() -> Iterator[Recipe]:
    """The built-in shafts; seat diameters follow the bores of ISO 15, keyways DIN 6885."""
    yield from one_per_row("two_step_shaft.csv", "two_step_shaft_{d1}x{l1}x{l2}", two_step_shaft)
    yield from one_per_row("keyed_shaft.csv", "keyed_shaft_{d2}x{d4}x{l3}", keyed_shaft)
    yield from one_per_row("flatted_shaft.csv", "flatted_shaft_{d1}x{l1}", flatted_shaft)
    yield from one_per_row("end_bored_shaft.csv", "end_bored_shaft_{d2}x{l2}", end_bored_shaft)
    yield from one_per_row("grooved_shaft.csv", "grooved_shaft_{d1}x{l1}", grooved_shaft)
    yield from one_per_row("square_end_shaft.csv", "square_end_shaft_{d1}x{s}x{l1}", square_end_shaft)
    yield from one_per_row("hollow_shaft.csv", "hollow_shaft_{d2}x{bore}x{l2}", hollow_shaft)
    yield from one_per_row("taper_shaft.csv", "taper_shaft_{d1}x{l1}", taper_shaft)
    yield from one_per_row("flanged_shaft.csv", "flanged_shaft_{D}x{l1}", flanged_shaft)
    yield from one_per_row(
        "iso14_spline.csv", "splined_shaft_{z}x{d}x{D}x{l}", splined_shaft, source="ISO 14; own lengths"
    )


def seats(size: dict[str, float]) -> sh.Shape:
    """Up to five cylinders of ``d1_mm``, ``l1_mm`` ... on top of each other, both ends chamfered."""
    numbers = [n for n in range(1, 6) if size.get(f"d{n}_mm", 0.0) > 0]
    radii = [size[f"d{n}_mm"] / 2 for n in numbers]
    ends = np.cumsum([0.0, *(size[f"l{n}_mm"] for n in numbers)])
    profile = [(0.0, 0.0), (radii[0] - CHAMFER, 0.0), (radii[0], CHAMFER)]
    for radius, z0, z1 in zip(radii, ends[:-1], ends[1:], strict=True):
        profile += [(radius, float(z0))] * int(z0 > 0) + [(radius, float(z1))] * int(z1 < ends[-1])
    top = float(ends[-1])
    profile += [(radii[-1], top - CHAMFER), (radii[-1] - CHAMFER, top), (0.0, top)]
    return sh.turned(profile)


def keyway(radius: float, width: float, depth: float, z0: float, z1: float) -> Manifold:
    """A keyway milled into the +x side of a shaft; hulls fill it, since no finger enters."""
    middle = shapely.LineString([(z0 + width / 2, 0), (z1 - width / 2, 0)]).buffer(width / 2, quad_segs=16)
    outline = np.asarray(shapely.get_coordinates(middle))[:-1]
    return sh.tool(s.extrude(outline[::-1], -radius - 1, depth - radius)).turned("y", -90).body


def two_step_shaft(size: dict[str, float]) -> s.Solid:
    """A pivot: thick seat, thin seat."""
    return seats(size).solid()


def keyed_shaft(size: dict[str, float]) -> s.Solid:
    """Four or five seats; a keyway of DIN 6885 in the middle of the third."""
    body = seats(size)
    start = size["l1_mm"] + size["l2_mm"]
    middle, length = start + size["l3_mm"] / 2, size["key_mm"]
    cut = keyway(size["d3_mm"] / 2, size["b_mm"], size["t1_mm"], middle - length / 2, middle + length / 2)
    return body.drilled(cut).solid()


def flatted_shaft(size: dict[str, float]) -> s.Solid:
    """A plain shaft with one flat at its lower end, and two opposite ones at its upper end."""
    r, total, flat, length = size["d1_mm"] / 2, size["l1_mm"], size["flat_mm"], size["flat_length_mm"]
    c, x = CHAMFER, size["across_mm"] / 2
    # Three lengths, each cut on its own: cut as one, a flat would leave slivers of the full length.
    lower = sh.turned([(0, 0), (r - c, 0), (r, c), (r, length), (0, length)])
    upper = sh.turned([(0, total - length), (r, total - length), (r, total - c), (r - c, total), (0, total)])
    lower = lower - sh.block(flat - r, r + 1, -2 * r, 2 * r, -1, length + 1)
    if x > 0:
        side = sh.block(x, r + 1, -2 * r, 2 * r, total - length - 1, total + 1)
        upper = upper - side - side.mirrored("x")
    return (lower + sh.cylinder(r, length, total - length) + upper).solid()


def end_bored_shaft(size: dict[str, float]) -> s.Solid:
    """Seats with a tapped hole in each end, modelled as its bore, and one across the middle seat."""
    total = size["l1_mm"] + size["l2_mm"] + size["l3_mm"]
    r, depth = size["hole_mm"] / 2, size["depth_mm"]
    across = size["l1_mm"] + size["l2_mm"] / 2
    return (
        seats(size)
        .drilled(
            sh.cylinder(r, -1, depth),
            sh.cylinder(r, total - depth, total + 1),
            s.drill(size["across_mm"] / 2, (-size["d2_mm"], 0, across), "x", 2 * size["d2_mm"]),
        )
        .solid()
    )


def grooved_shaft(size: dict[str, float]) -> s.Solid:
    """A plain shaft with a groove for a retaining ring near each end; hulls fill the grooves."""
    r, total, inset = size["d1_mm"] / 2, size["l1_mm"], size["inset_mm"]
    m, d = size["m_mm"], size["groove_mm"] / 2
    ring = sh.tool(s.lathe([(d, 0), (r + 1, 0), (r + 1, m), (d, m)]))
    return seats(size).drilled(ring.moved(z=inset), ring.moved(z=total - inset - m)).solid()


def square_end_shaft(size: dict[str, float]) -> s.Solid:
    """A round shaft with a collar, whose upper end is a square for a handwheel or a crank."""
    total, a = size["l1_mm"] + size["l2_mm"] + size["l3_mm"], size["s_mm"] / 2
    return (seats(size) + sh.block(-a, a, -a, a, total - 1, total + size["square_mm"])).solid()


def hollow_shaft(size: dict[str, float]) -> s.Solid:
    """Three seats about one through bore."""
    profile, z = [], 0.0
    for number in (1, 2, 3):
        radius, top = size[f"d{number}_mm"] / 2, z + size[f"l{number}_mm"]
        profile += [(radius, z), (radius, top)]
        z = top
    bore = size["bore_mm"] / 2
    return sh.turned([(bore, 0.0), *profile, (bore, z)]).solid()


def taper_shaft(size: dict[str, float]) -> s.Solid:
    """A seat, a collar, a taper of 1:10 and a threaded end."""
    r, collar, end = size["d1_mm"] / 2, size["d2_mm"] / 2, size["d3_mm"] / 2
    z = np.cumsum([size["l1_mm"], size["l2_mm"], size["l3_mm"], size["l4_mm"]])
    small = r - size["l3_mm"] / 20
    profile = [(0, 0), (r - CHAMFER, 0), (r, CHAMFER), (r, z[0]), (collar, z[0]), (collar, z[1]), (r, z[1])]
    profile += [(small, z[2]), (end, z[2]), (end, z[3] - CHAMFER), (end - CHAMFER, z[3]), (0, z[3])]
    return sh.turned([(float(radius), float(height)) for radius, height in profile]).solid()


def flanged_shaft(size: dict[str, float]) -> s.Solid:
    """A shaft end with a bolted flange."""
    r, flange, t = size["d1_mm"] / 2, size["D_mm"] / 2, size["t_mm"]
    top = t + size["l1_mm"]
    body = sh.turned([(0, 0), (flange, 0), (flange, t), (r, t), (r, top - 1), (r - 1, top), (0, top)])
    angles = 2 * np.pi * np.arange(int(size["holes"])) / size["holes"]
    circle, hole = size["circle_mm"] / 2, size["hole_mm"] / 2
    holes = [s.drill(hole, (circle * np.cos(a), circle * np.sin(a), -1), "z", t + 2) for a in angles]
    return body.drilled(*holes).solid()


def splined_shaft(size: dict[str, float]) -> s.Solid:
    """Straight-sided splines between two journals."""
    inner, outer, width, teeth = size["d_mm"] / 2, size["D_mm"] / 2, size["b_mm"] / 2, int(size["z"])
    z0, z1 = size["journal_length_mm"], size["l_mm"] - size["journal_length_mm"]
    journal = size["journal_mm"] / 2
    body = sh.turned(
        [(0, 0), (journal - 1, 0), (journal, 1), (journal, z0), (inner, z0), (inner, z1), (journal, z1)]
        + [(journal, size["l_mm"] - 1), (journal - 1, size["l_mm"]), (0, size["l_mm"])]
    )
    # The outline of a tooth ends on the outer circle, not on its chord.
    angle = np.arcsin(width / outer)
    tip = [[outer * np.cos(a), outer * np.sin(a)] for a in np.linspace(-angle, angle, 5)]
    foot = np.sqrt(inner**2 - width**2) - 0.5
    tooth = sh.plate(np.array([[foot, -width], *tip, [foot, width]]), z0, z1)
    for number in range(teeth):
        body = body + tooth.turned("z", 360 * number / teeth)
    return body.solid()
