"""Bent and cast angular brackets: ribbed, slotted and drilled angles, Z-, hat- and fork brackets."""

from __future__ import annotations

from collections.abc import Iterator

from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.listing import one_per_row
from mskgrasp.parts.recipes.recipe import ALUMINIUM, Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s


def recipes() -> Iterator[Recipe]:
    """The built-in brackets besides the plain ones."""
    yield from one_per_row("ribbed_bracket.csv", "ribbed_bracket_{a}x{b}x{w}", ribbed_bracket)
    yield from one_per_row("profile_angle.csv", "profile_angle_{a}x{b}x{w}", profile_angle, density=ALUMINIUM)
    yield from one_per_row("slotted_bracket.csv", "slotted_bracket_{a}x{b}", slotted_bracket)
    yield from one_per_row("drilled_angle.csv", "drilled_angle_{a}x{b}x{w}", drilled_angle)
    yield from one_per_row("z_bracket.csv", "z_bracket_{a}x{b}x{c}", z_bracket)
    yield from one_per_row("hat_bracket.csv", "hat_bracket_{c}x{b}x{w}", hat_bracket)
    yield from one_per_row("fork_bracket.csv", "fork_bracket_{a}x{b}x{w}", fork_bracket, density=ALUMINIUM)


def ribbed_bracket(size: dict[str, float]) -> s.Solid:
    """Foot along x, wall along z, a gusset between them in the middle, two holes on either side of it."""
    a, b, w, t = size["a_mm"], size["b_mm"], size["w_mm"] / 2, size["t_mm"]
    rib, hole = size["rib_mm"] / 2, size["hole_mm"] / 2
    bracket = _angle(a, b, w, t) + _gusset(0.85 * a, 0.85 * b, t, -rib, rib)
    return _drill_legs(bracket, a, b, t, hole, [(0.62, -w / 2 - rib / 2), (0.62, w / 2 + rib / 2)]).solid()


def profile_angle(size: dict[str, float]) -> s.Solid:
    """Foot and wall with a cheek along each side, as cast for slotted profiles; one hole a leg."""
    a, b, w, t, rib = size["a_mm"], size["b_mm"], size["w_mm"] / 2, size["t_mm"], size["rib_mm"]
    bracket = _angle(a, b, w, t)
    for y in (-w, w - rib):
        bracket += _gusset(a - 1, b - 1, 2 * t, y, y + rib)
    return _drill_legs(bracket, a, b, t, size["hole_mm"] / 2, [(0.55, 0.0)]).solid()


def slotted_bracket(size: dict[str, float]) -> s.Solid:
    """Foot and wall, each with a slot along it."""
    a, b, w, t, half = size["a_mm"], size["b_mm"], size["w_mm"] / 2, size["t_mm"], size["slot_mm"] / 2
    start = 2 * t + 2 * half
    foot = o.pierced(s.rectangle(0, a, -w, w), 0, t, [o.slot(start, a - 3 * half, 0, half)])
    wall = o.pierced(s.rectangle(0, b, -w, w), -t, 0, [o.slot(start, b - 3 * half, 0, half)])
    return (foot + wall.turned("y", -90)).solid()


def drilled_angle(size: dict[str, float]) -> s.Solid:
    """Angle steel along y with rows of screw holes in both legs; the hulls fill them."""
    a, b, w, t, holes = size["a_mm"], size["b_mm"], size["w_mm"] / 2, size["t_mm"], int(size["holes"])
    where = [(0.58, 2 * w * ((n + 0.5) / holes - 0.5)) for n in range(holes)]
    return _drill_legs(_angle(a, b, w, t), a, b, t, size["hole_mm"] / 2, where).solid()


def z_bracket(size: dict[str, float]) -> s.Solid:
    """A lower leg along x, a wall, an upper leg that points the other way; one hole in each leg."""
    a, b, c, w, t = size["a_mm"], size["b_mm"], size["c_mm"], size["w_mm"] / 2, size["t_mm"]
    hole = size["hole_mm"] / 2
    low = s.rectangle(0, a, -w, w)
    high = s.rectangle(t - c, t, -w, w)
    shape = h.plate(low, 0, t, [((a + t) / 2, 0, hole)]) + h.block(0, t, -w, w, 0, b)
    return (shape + h.plate(high, b - t, b, [((t - c) / 2, 0, hole)])).solid()


def hat_bracket(size: dict[str, float]) -> s.Solid:
    """Two feet, two walls that lean by 10 degrees, a crown with a hole; y runs along the bend."""
    a, b, c, w, t = size["a_mm"], size["b_mm"], size["c_mm"] / 2, size["w_mm"] / 2, size["t_mm"]
    hole, lean = size["hole_mm"] / 2, 0.176 * (b - size["t_mm"])
    base = c + lean
    right = [(base - t, 0), (base + a, 0), (base + a, t), (base, t), (c, b)]
    inner = [(c - t, b - t), (base - t, 0)]
    section = [*right, *[(-x, z) for x, z in right[::-1]], *[(-x, z) for x, z in inner[::-1]], inner[0]]
    shape = o.along_y(section, -w, w).drilled(s.drill(hole, (0, 0, 0), "z", b + 1))
    for x in (base + 0.55 * a, -base - 0.55 * a):
        shape = shape.drilled(s.drill(hole, (x, 0, -1), "z", t + 2))
    return shape.solid()


def fork_bracket(size: dict[str, float]) -> s.Solid:
    """A base along x with two round-topped cheeks across it and a bore through both."""
    a, b, w, t = size["a_mm"] / 2, size["b_mm"], size["w_mm"] / 2, size["t_mm"]
    cheek, bore, hole = size["cheek_mm"] / 2, size["bore_mm"] / 2, size["hole_mm"] / 2
    side = h.plate(o.arch(cheek, 0, b - cheek), 0, t, [(0, b - cheek, bore)]).turned("x", 90)
    base = h.block(-a, a, -w, w, 0, t)
    for x in (cheek + (a - cheek) / 2, -cheek - (a - cheek) / 2):
        base = base.drilled(s.drill(hole, (x, 0, -1), "z", t + 2))
    return (base + side.moved(y=w) + side.moved(y=t - w)).solid()


def _angle(a: float, b: float, w: float, t: float) -> h.Shape:
    return o.along_y([(0, 0), (a, 0), (a, t), (t, t), (t, b), (0, b)], -w, w)


def _gusset(a: float, b: float, lip: float, y0: float, y1: float) -> h.Shape:
    """A web that fills the corner of an angle up to a slope between the ends of its legs."""
    return o.along_y([(0, 0), (a, 0), (a, lip), (lip, b), (0, b)], y0, y1)


def _drill_legs(
    shape: h.Shape, a: float, b: float, t: float, radius: float, where: list[tuple[float, float]]
) -> h.Shape:
    """Holes in both legs at (share of the leg's length, y)."""
    for share, y in where:
        shape = shape.drilled(
            s.drill(radius, (share * a, y, -1), "z", t + 2), s.drill(radius, (-1, y, share * b), "x", t + 2)
        )
    return shape
