"""Hinges: butt hinges at several angles, block, strap, weld-on and corner hinges."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.listing import one_per_row
from mskgrasp.parts.recipes.recipe import ALUMINIUM, Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s

ZINC = 6700.0


def recipes() -> Iterator[Recipe]:
    """The built-in hinges."""
    yield from one_per_row("butt_hinge.csv", "butt_hinge_{l}x{b}_{angle}", butt_hinge)
    yield from one_per_row("block_hinge.csv", "block_hinge_{l}x{b}", block_hinge, density=ZINC)
    yield from one_per_row("strap_hinge.csv", "strap_hinge_{p}x{l}", strap_hinge)
    yield from one_per_row("weld_hinge.csv", "weld_hinge_{l}x{d}", weld_hinge)
    yield from one_per_row("corner_hinge.csv", "corner_hinge_{l}x{b}", corner_hinge, density=ALUMINIUM)


def butt_hinge(size: dict[str, float]) -> s.Solid:
    """Two leaves about a knuckle along y, opened by an angle in degrees; screw holes filled in the hulls.

    At 0 degrees the leaves lie on each other, at 180 in one plane; the gap that a real hinge has between its
    closed leaves is left out.
    """
    length, b, r, t = size["l_mm"] / 2, size["b_mm"], size["d_mm"] / 2, size["t_mm"]
    knuckle = h.cylinder(r, -length, length).turned("x", 90)
    leaf = h.block(0, b, -length, length, -t, 0)
    for y in (-0.6 * length, 0.6 * length):
        leaf = leaf.drilled(s.drill(size["hole_mm"] / 2, (0.5 * (r + b), y, -t - 1), "z", t + 2))
    other = leaf.mirrored("z").turned("y", -size["angle"])
    return (knuckle + leaf + other).solid()


def block_hinge(size: dict[str, float]) -> s.Solid:
    """A die-cast hinge for profiles: two thick leaves in one plane, a thick knuckle, countersunk holes."""
    length, b, r, t = size["l_mm"] / 2, size["b_mm"], size["d_mm"] / 2, size["t_mm"]
    knuckle = h.cylinder(r, -length, length).turned("x", 90).moved(z=r)
    shape = knuckle + h.block(-b, b, -length, length, 0, t)
    for x in (-0.6 * b - 0.4 * r, 0.6 * b + 0.4 * r):
        for y in (-0.55 * length, 0.55 * length):
            shape = shape.drilled(s.drill(size["hole_mm"] / 2, (x, y, -1), "z", t + 2))
    return shape.solid()


def strap_hinge(size: dict[str, float]) -> s.Solid:
    """A knuckle along y, a short plate on one side and a long tapering strap on the other."""
    p, length, w, r, t = size["p_mm"], size["l_mm"] / 2, size["w_mm"] / 2, size["d_mm"] / 2, size["t_mm"]
    knuckle = h.cylinder(r, -length, length).turned("x", 90).moved(z=r)
    strap = h.plate(np.array([[0, -0.9 * length], [p, -w], [p, w], [0, 0.9 * length]]), 0, t)
    for share in (0.3, 0.6, 0.9):
        strap = strap.drilled(s.drill(size["hole_mm"] / 2, (share * p, 0, -1), "z", t + 2))
    plate = h.block(-size["b_mm"], 0, -length, length, 0, t)
    for y in (-0.6 * length, 0.6 * length):
        plate = plate.drilled(s.drill(size["hole_mm"] / 2, (-0.6 * size["b_mm"], y, -1), "z", t + 2))
    return (knuckle + strap + plate).solid()


def weld_hinge(size: dict[str, float]) -> s.Solid:
    """A lift-off hinge to be welded on: two barrels along z with a washer between and a wing each."""
    length, d, wing, t = size["l_mm"], size["d_mm"] / 2, size["wing_mm"], size["t_mm"] / 2
    middle, tip = length / 2, 0.3 * d
    barrel = h.turned(
        [
            (0, 0),
            (d - tip, 0),
            (d, tip),
            (d, middle - 1),
            (0.8 * d, middle - 1),
            (0.8 * d, middle + 1),
            (d, middle + 1),
            (d, length - tip),
            (d - tip, length),
            (0, length),
        ]
    )
    low = h.block(0, wing, -t, t, tip, middle - 2)
    high = h.block(-wing, 0, -t, t, middle + 2, length - tip)
    return (barrel + low + high).solid()


def corner_hinge(size: dict[str, float]) -> s.Solid:
    """Two angle profiles that fold about a knuckle along y: a hinge with leaves bent at right angles."""
    length, b, r, t = size["l_mm"] / 2, size["b_mm"], size["d_mm"] / 2, size["t_mm"]
    lip = size["lip_mm"]
    shape = h.cylinder(r, -length, length).turned("x", 90)
    for side in (1, -1):
        outline = np.array([[0, -t], [b, -t], [b, -lip], [b - t, -lip], [b - t, -2 * t], [0, -2 * t]])
        outline = outline * [side, 1]
        leaf = o.along_y(outline if side < 0 else outline[::-1], -length, length)
        hole = s.drill(size["hole_mm"] / 2, (side * 0.55 * b, 0, -3 * t), "z", 4 * t)
        shape += leaf.drilled(hole)
    return shape.solid()
