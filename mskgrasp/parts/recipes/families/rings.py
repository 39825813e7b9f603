"""Rings that sit on shafts: rolling and plain bearings, bushings, shaft collars, spacers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from manifold3d import Manifold

from mskgrasp.parts.recipes.families.listing import OWN, POLYAMIDE, one, one_per_row
from mskgrasp.parts.recipes.recipe import ALUMINIUM, BRONZE, STEEL, Recipe, table_row
from mskgrasp.parts.solids import shape as sh
from mskgrasp.parts.solids import solid as s

BEARING = 5300.0
"""Density of the solid ring, kg/m^3: a 6204 then has its catalogue mass of 0.106 kg with hollow raceways."""


def recipes() -> Iterator[Recipe]:
    """The built-in rings."""
    for recipe in one_per_row(
        "iso15_bearing.csv", "bearing_{code}", bearing, source="ISO 15", density=BEARING
    ):
        del recipe.dimensions["code"]
        yield recipe
    row = table_row("iso4379_bushing.csv", d1_mm=20)
    yield one(row, "bushing_{d1}x{d2}x{b1}", bushing, source="ISO 4379", density=BRONZE)
    row = table_row("din705_shaft_collar.csv", d1_mm=25)
    yield one(row, "shaft_collar_{d1}", shaft_collar, source="DIN 705")
    for file_name, name, make, source, density in (
        ("iso4379_form_c.csv", "bushing_{d1}x{d2}x{b1}", bushing, "ISO 4379 form C", BRONZE),
        ("iso4379_form_f.csv", "flanged_bushing_{d1}x{d2}x{b1}", flanged_bushing, "ISO 4379 form F", BRONZE),
        ("din705_form_a.csv", "shaft_collar_{d1}", set_screw_collar, "DIN 705 form A", STEEL),
        ("needle_bearing.csv", "needle_bearing_{d}x{D}x{B}", needle_bearing, "ISO 15 series 49, 69", BEARING),
        ("iso104_thrust_bearing.csv", "thrust_bearing_{code}", thrust_bearing, "ISO 104", BEARING),
        (
            "iso12240_spherical.csv",
            "spherical_bearing_ge{d}",
            spherical_bearing,
            "ISO 12240-1 series E",
            STEEL,
        ),
        ("iso10285_linear.csv", "linear_bearing_{d}x{D}", linear_bearing, "ISO 10285 series 3", BEARING),
        (
            "flanged_linear.csv",
            "flanged_linear_bearing_{d}x{L}",
            flanged_linear_bearing,
            "ISO 10285 series 3, own flange",
            BEARING,
        ),
        ("spacer.csv", "spacer_{D}x{d}x{L}", spacer, OWN, ALUMINIUM),
        ("stepped_spacer.csv", "stepped_spacer_{d2}x{L}", stepped_spacer, OWN, STEEL),
        ("plastic_sleeve.csv", "plastic_sleeve_{D}x{L}", plastic_sleeve, OWN, POLYAMIDE),
        ("trapezoidal_nut.csv", "trapezoidal_nut_tr{d}x{L}", trapezoidal_nut, OWN, BRONZE),
    ):
        yield from one_per_row(
            file_name, name, make, source=source, density=density, family=_FAMILIES.get(make.__name__, "")
        )


_FAMILIES = {"set_screw_collar": "shaft_collar"}


def bearing(size: dict[str, float]) -> s.Solid:
    """A ring with rounded edges and the shields set 0.4 mm deep; its hulls have sharp edges and no recess."""
    inner, outer, width, r = size["d_mm"] / 2, size["D_mm"] / 2, size["B_mm"], size["r_mm"]
    wall, deep = outer - inner, 0.4
    profile = [
        *_rounded(inner, 0, r, 1, 1),
        (inner + 0.25 * wall, 0),
        (inner + 0.25 * wall, deep),
        (outer - 0.25 * wall, deep),
        (outer - 0.25 * wall, 0),
        *_rounded(outer, 0, r, -1, 1)[::-1],
        *_rounded(outer, width, r, -1, -1),
        (outer - 0.25 * wall, width),
        (outer - 0.25 * wall, width - deep),
        (inner + 0.25 * wall, width - deep),
        (inner + 0.25 * wall, width),
        *_rounded(inner, width, r, 1, -1)[::-1],
    ]
    return s.solid(s.lathe(profile), s.ring(outer, inner, 0, width))


def _rounded(radius: float, z: float, r: float, inward: int, up: int) -> list[tuple[float, float]]:
    """A rounded corner, from the cylinder (``radius``) to the face (``z``)."""
    angles = np.linspace(0, np.pi / 2, 5)
    return [(radius + inward * r * (1 - np.cos(angle)), z + up * r * (1 - np.sin(angle))) for angle in angles]


def bushing(size: dict[str, float]) -> s.Solid:
    """A plain tube."""
    outer, bore, length = size["d2_mm"] / 2, size["d1_mm"] / 2, size["b1_mm"]
    return s.solid(s.extrude(s.circle(outer), 0, length, [s.circle(bore)]), s.ring(outer, bore, 0, length))


def shaft_collar(size: dict[str, float]) -> s.Solid:
    """A plain ring."""
    outer, bore, width = size["d2_mm"] / 2, size["d1_mm"] / 2, size["b_mm"]
    return s.solid(s.extrude(s.circle(outer), 0, width, [s.circle(bore)]), s.ring(outer, bore, 0, width))


def tube(outer: float, bore: float, z0: float, z1: float) -> sh.Shape:
    """A ring of two radii with the fewest hulls."""
    return sh.tool(s.extrude(s.circle(outer), z0, z1, [s.circle(bore)]), s.ring(outer, bore, z0, z1))


def groove(outer: float, floor: float, z0: float, z1: float) -> sh.Shape:
    """The volume turned off the outside; hulls fill it."""
    return sh.tool(s.lathe([(floor, z0), (outer + 1, z0), (outer + 1, z1), (floor, z1)]))


def bolt_circle(circle: float, radius: float, number: int, z0: float, z1: float) -> list[Manifold]:
    """Equal holes along z on a circle about z, the first at +x."""
    angles = 2 * np.pi * np.arange(number) / number
    return [
        s.drill(radius, (circle * np.cos(angle), circle * np.sin(angle), z0), "z", z1 - z0)
        for angle in angles
    ]


def set_screw_collar(size: dict[str, float]) -> s.Solid:
    """A ring with the radial hole of its set screw, which hulls fill."""
    outer, bore, width = size["d2_mm"] / 2, size["d1_mm"] / 2, size["b_mm"]
    screw = s.drill(size["screw_mm"] / 2, (0, 0, width / 2), "x", outer + 1)
    return tube(outer, bore, 0, width).drilled(screw).solid()


def flanged_bushing(size: dict[str, float]) -> s.Solid:
    """A tube with a flange below."""
    bore, outer, flange = size["d1_mm"] / 2, size["d2_mm"] / 2, size["d3_mm"] / 2
    t, length = size["b2_mm"], size["b1_mm"]
    return sh.turned(
        [(bore, 0), (flange, 0), (flange, t), (outer, t), (outer, length), (bore, length)]
    ).solid()


def needle_bearing(size: dict[str, float]) -> s.Solid:
    """A machined outer ring with an oil groove about its middle, the inner ring set 0.4 mm deep."""
    inner, outer, width = size["d_mm"] / 2, size["D_mm"] / 2, size["B_mm"]
    wall, middle = outer - inner, width / 2
    ring = tube(outer, inner, 0, width).drilled(groove(outer, outer - 0.8, middle - 1, middle + 1))
    near, far = inner + 0.45 * wall, inner + 0.6 * wall
    slot = s.lathe([(near, -1), (far, -1), (far, 0.4), (near, 0.4)])
    return ring.drilled(slot, slot.mirror((0, 0, 1)).translate((0, 0, width))).solid()


def thrust_bearing(size: dict[str, float]) -> s.Solid:
    """Two washers with the row of balls between them, here as one solid with a groove about it."""
    bore, outer, height = size["d_mm"] / 2, size["D_mm"] / 2, size["T_mm"]
    gap, middle = 0.15 * height, height / 2
    housing = s.extrude(s.circle(size["D1_mm"] / 2), -1, middle - gap / 2)
    slit = groove(outer, outer - 0.8, middle - gap / 2, middle + gap / 2)
    ring = tube(outer, bore, 0, height).drilled(slit, housing)
    # The bore of the hulls is between those of the two washers, which differ by 1 mm in radius.
    hole = s.balanced_polygon((bore + size["D1_mm"] / 2) / 2, 18)
    return s.solid(ring.body, s.around_hole(s.round_outline(outer, 18), hole, 0, height))


def spherical_bearing(size: dict[str, float]) -> s.Solid:
    """An outer ring about a ball that is wider than the ring."""
    bore, outer, width = size["d_mm"] / 2, size["D_mm"] / 2, size["B_mm"] / 2
    ring, ball = size["C_mm"] / 2, size["dk_mm"] / 2
    angles = np.linspace(np.arcsin(width / ball), np.arcsin(ring / ball), 6)
    side = [(float(ball * np.cos(a)), float(ball * np.sin(a))) for a in angles]
    upper = [(bore, width), *side, (outer - 0.6, ring), (outer, ring - 0.6)]
    profile = upper + [(radius, -z) for radius, z in upper[::-1]]
    body = s.lathe(profile[::-1])
    # Straight collars of the ball's mean radius represent the ends that project from the ring.
    mean = (side[0][0] + side[-1][0]) / 2
    collar = s.around_hole(s.balanced_polygon(mean, 24), s.balanced_polygon(bore, 8), ring, width)
    below = [points * [1, 1, -1] for points in collar]
    return s.solid(body, [*s.ring(outer, bore, -ring, ring), *collar, *below])


def linear_bearing(size: dict[str, float]) -> s.Solid:
    """A tube with two grooves for retaining rings and set-in seals."""
    bore, outer, length = size["d_mm"] / 2, size["D_mm"] / 2, size["L_mm"]
    grooves = (groove(outer, outer - 0.6, z, z + 1.3) for z in (0.14 * length, 0.86 * length - 1.3))
    seal = sh.tool(s.lathe([(bore + 0.8, -1), (outer - 1.2, -1), (outer - 1.2, 0.5), (bore + 0.8, 0.5)]))
    body = tube(outer, bore, 0, length)
    return body.drilled(*grooves, seal, seal.mirrored("z").moved(z=length)).solid()


def flanged_linear_bearing(size: dict[str, float]) -> s.Solid:
    """A linear bearing with a round flange at one end."""
    bore, outer, length = size["d_mm"] / 2, size["D_mm"] / 2, size["L_mm"]
    flange, t = size["flange_mm"] / 2, size["t_mm"]
    body = sh.turned([(bore, 0), (flange, 0), (flange, t), (outer, t), (outer, length), (bore, length)])
    return body.drilled(*bolt_circle((outer + flange) / 2, size["hole_mm"] / 2, 4, -1, t + 0.5)).solid()


def spacer(size: dict[str, float]) -> s.Solid:
    """A tube."""
    return tube(size["D_mm"] / 2, size["d_mm"] / 2, 0, size["L_mm"]).solid()


def stepped_spacer(size: dict[str, float]) -> s.Solid:
    """A tube with a thinner neck at one end."""
    bore, thin, thick = size["d_mm"] / 2, size["d1_mm"] / 2, size["d2_mm"] / 2
    neck, top = size["neck_mm"], size["L_mm"]
    return sh.turned([(bore, 0), (thin, 0), (thin, neck), (thick, neck), (thick, top), (bore, top)]).solid()


def plastic_sleeve(size: dict[str, float]) -> s.Solid:
    """A tube with a flange at each end: a spool for a belt or a cable."""
    bore, outer, flange = size["d_mm"] / 2, size["D_mm"] / 2, size["flange_mm"] / 2
    t, top = size["t_mm"], size["L_mm"]
    profile = [(bore, 0), (flange, 0), (flange, t), (outer, t), (outer, top - t), (flange, top - t)]
    return sh.turned([*profile, (flange, top), (bore, top)]).solid()


def trapezoidal_nut(size: dict[str, float]) -> s.Solid:
    """A round nut with a bolted flange; the bore has the thread's minor diameter."""
    bore, outer, flange = (size["d_mm"] - size["p_mm"]) / 2, size["D_mm"] / 2, size["flange_mm"] / 2
    t, neck, top = size["t_mm"], size["neck_mm"], size["L_mm"]
    profile = [(bore, 0), (outer, 0), (outer, neck), (flange, neck), (flange, neck + t), (outer, neck + t)]
    body = sh.turned([*profile, (outer, top), (bore, top)])
    circle, hole = (outer + flange) / 2, size["hole_mm"] / 2
    return body.drilled(*bolt_circle(circle, hole, int(size["holes"]), neck - 0.5, neck + t + 0.5)).solid()
