"""Supports of shafts and rails: shaft supports, flanged housings, linear blocks and carriages."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.listing import CAST_IRON, one_per_row
from mskgrasp.parts.recipes.recipe import ALUMINIUM, Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s


def recipes() -> Iterator[Recipe]:
    """The built-in supports."""
    yield from one_per_row("shaft_support.csv", "shaft_support_{d}x{a}", shaft_support, density=ALUMINIUM)
    yield from one_per_row("flange_support.csv", "flange_support_{d}x{a}", flange_support, density=ALUMINIUM)
    yield from one_per_row("flange_housing.csv", "flange_housing_{d}x{a}", flange_housing, density=CAST_IRON)
    yield from one_per_row("square_mount.csv", "square_mount_{d}x{a}", square_mount, density=CAST_IRON)
    yield from one_per_row("linear_block.csv", "linear_block_{d}x{a}x{l}", linear_block, density=ALUMINIUM)
    yield from one_per_row("carriage.csv", "carriage_{a}x{b}x{l}", carriage)
    yield from one_per_row("dovetail_slide.csv", "dovetail_slide_{a}x{b}x{l}", dovetail_slide)
    yield from one_per_row(
        "screw_nut_block.csv", "screw_nut_block_{d}x{l}", screw_nut_block, density=ALUMINIUM
    )


def shaft_support(size: dict[str, float]) -> s.Solid:
    """A foot along x, a clamping head with its bore along y and a slit above the bore."""
    a, b, w, t = size["a_mm"] / 2, size["b_mm"], size["w_mm"] / 2, size["t_mm"]
    head, top, bore, slit = size["head_mm"] / 2, size["h_mm"], size["d_mm"] / 2, size["slit_mm"] / 2
    outline = np.array([[-a, 0], [a, 0], [a, t], [head, t], [head, top], [-head, top], [-head, t], [-a, t]])
    body = h.plate(outline, -w, w, [(0, b, bore)]) - h.block(-slit, slit, b, top + 1, -w - 1, w + 1)
    body = body.turned("x", 90)
    for x in ((a + head) / 2, -(a + head) / 2):
        body = body.drilled(s.drill(size["hole_mm"] / 2, (x, 0, -1), "z", t + 2))
    return body.solid()


def flange_support(size: dict[str, float]) -> s.Solid:
    """An oval flange with a boss about the bore; the boss is slit on one side."""
    a, b, t, length = size["a_mm"] / 2, size["b_mm"] / 2, size["t_mm"], size["l_mm"]
    boss, bore, hole = size["boss_mm"] / 2, size["d_mm"] / 2, size["hole_mm"] / 2
    ear = 1.9 * hole
    flange = h.plate(o.belt((0, 0, b), (a - ear, 0, ear), (ear - a, 0, ear)), 0, t, [(0, 0, bore)])
    sleeve = h.tool(o.tube(boss, bore, t / 2, length).body, o.hollow(bore, boss, t, length))
    slit = h.block(-boss - 1, 0, -1, 1, t, length + 1)
    shape = flange + (sleeve - slit)
    for x in (a - ear, ear - a):
        shape = shape.drilled(s.drill(hole, (x, 0, -1), "z", t + 2))
    return shape.solid()


def flange_housing(size: dict[str, float]) -> s.Solid:
    """A rhombic cast flange for two bolts with a conical housing about the bore."""
    a, b, t, length = size["a_mm"] / 2, size["b_mm"] / 2, size["t_mm"], size["l_mm"]
    bore, ear, hole = size["d_mm"] / 2, size["ear_mm"] / 2, size["hole_mm"] / 2
    flange = h.plate(o.belt((0, 0, b), (a - ear, 0, ear), (ear - a, 0, ear)), 0, t, [(0, 0, bore)])
    dome = h.turned([(bore, t / 2), (0.96 * b, t / 2), (0.96 * b, t), (0.8 * b, length), (bore, length)])
    shape = flange + dome
    for x in (a - ear, ear - a):
        shape = shape.drilled(s.drill(hole, (x, 0, -1), "z", t + 2))
    return shape.solid()


def square_mount(size: dict[str, float]) -> s.Solid:
    """A square flange with blunt corners, four screw holes and a round boss about the bore."""
    a, t, length = size["a_mm"] / 2, size["t_mm"], size["l_mm"]
    bore, boss, hole = size["d_mm"] / 2, size["boss_mm"] / 2, size["hole_mm"] / 2
    outline = o.blunted(-a, a, -a, a, 0.35 * a)
    flange = h.plate(outline, 0, t, [(0, 0, bore)])
    shape = flange + h.tool(o.tube(boss, bore, t / 2, length).body, o.hollow(bore, boss, t, length))
    reach = 0.74 * a
    for x in (-reach, reach):
        for y in (-reach, reach):
            shape = shape.drilled(s.drill(hole, (x, y, -1), "z", t + 2))
    return shape.solid()


def linear_block(size: dict[str, float]) -> s.Solid:
    """A block with shoulders above, its bore along y for a linear bearing; four tapped holes from above."""
    a, b, length, step = size["a_mm"] / 2, size["b_mm"], size["l_mm"] / 2, size["step_mm"]
    rise, bore, hole = size["rise_mm"], size["d_mm"] / 2, size["hole_mm"] / 2
    outline = o.mirrored([(a - step, 0), (a, rise), (a, b)])
    block = h.plate(outline, -length, length, [(0, b / 2, bore)]).turned("x", 90)
    for x in (-0.75 * a, 0.75 * a):
        for y in (-0.6 * length, 0.6 * length):
            block = block.drilled(s.drill(hole, (x, y, b - 2.5 * hole), "z", 3 * hole))
    return block.solid()


def carriage(size: dict[str, float]) -> s.Solid:
    """A carriage that straddles a rail along x: end caps a little smaller, four tapped holes from above."""
    a, b, length, rail = size["a_mm"] / 2, size["b_mm"], size["l_mm"] / 2, size["rail_mm"] / 2
    deep, cap, hole = size["deep_mm"], size["cap_mm"], size["hole_mm"] / 2

    def straddling(wide: float, high: float, x0: float, x1: float) -> h.Shape:
        outline = o.mirrored([(rail, 0), (wide, 0), (wide, high)])
        section = np.concatenate([outline, [[-rail, deep], [rail, deep]]])
        return o.along_x(section, x0, x1)

    shape = straddling(a, b, cap - length, length - cap)
    for x0, x1 in ((-length, cap - length + 0.01), (length - cap - 0.01, length)):
        shape += straddling(a - 0.6, b - 0.8, x0, x1)
    for x in (-0.45, 0.45):
        for y in (-0.6, 0.6):
            shape = shape.drilled(s.drill(hole, (x * length, y * a, b - 2.5 * hole), "z", 3 * hole))
    return shape.solid()


def dovetail_slide(size: dict[str, float]) -> s.Solid:
    """A block with a dovetail groove of 60 degrees along x below; two tapped holes from above."""
    a, b, length, deep = size["a_mm"] / 2, size["b_mm"], size["l_mm"], size["deep_mm"]
    neck = size["neck_mm"] / 2
    flare = deep / np.tan(np.radians(60))
    outline = o.mirrored([(neck, 0), (a, 0), (a, b)])
    section = np.concatenate([outline, [[-neck - flare, deep], [neck + flare, deep]]])
    block = o.along_x(section, 0, length)
    for x in (0.22, 0.78):
        block = block.drilled(s.drill(size["hole_mm"] / 2, (x * length, 0, deep - 1), "z", b))
    return block.solid()


def screw_nut_block(size: dict[str, float]) -> s.Solid:
    """A block for a lead screw's nut: bored along y, with a wing to screw on either side."""
    a, b, length, t = size["a_mm"] / 2, size["b_mm"], size["l_mm"] / 2, size["t_mm"]
    core, bore, hole = size["core_mm"] / 2, size["d_mm"] / 2, size["hole_mm"] / 2
    block = h.plate(s.rectangle(-core, core, 0, b), -length, length, [(0, b / 2, bore)]).turned("x", 90)
    wings = h.block(-a, -core, -length, length, 0, t) + h.block(core, a, -length, length, 0, t)
    for x in ((a + core) / 2, -(a + core) / 2):
        for y in (-0.55 * length, 0.55 * length):
            wings = wings.drilled(s.drill(hole, (x, y, -1), "z", t + 2))
    return (block + wings).solid()
