"""Workholding parts: V-blocks, step blocks, jaws, gripper fingers, clamping straps and blocks."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.listing import CAST_IRON, POLYAMIDE, one_per_row
from mskgrasp.parts.recipes.recipe import ALUMINIUM, Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s


def recipes() -> Iterator[Recipe]:
    """The built-in workholding parts."""
    yield from one_per_row("v_block.csv", "v_block_{a}x{b}x{l}", v_block, density=CAST_IRON)
    yield from one_per_row("step_block.csv", "step_block_{a}x{b}x{w}", step_block)
    yield from one_per_row("soft_jaw.csv", "soft_jaw_{a}x{b}x{w}", soft_jaw, density=ALUMINIUM)
    yield from one_per_row("gripper_finger.csv", "gripper_finger_{a}x{b}", gripper_finger, density=ALUMINIUM)
    yield from one_per_row("clamp_strap.csv", "clamp_strap_{l}x{w}", clamp_strap)
    yield from one_per_row("saddle_clamp.csv", "saddle_clamp_{d}x{w}", saddle_clamp)
    yield from one_per_row("p_clip.csv", "p_clip_{d}x{w}", p_clip)
    yield from one_per_row("pipe_clamp.csv", "pipe_clamp_{d}x{a}", pipe_clamp, density=POLYAMIDE)
    yield from one_per_row("split_clamp.csv", "split_clamp_{d}x{l}", split_clamp, density=ALUMINIUM)


def v_block(size: dict[str, float]) -> s.Solid:
    """A block along x with a V of 90 degrees above, a relief slit below it, a groove along either flank."""
    a, b, length, v = size["a_mm"] / 2, size["b_mm"], size["l_mm"], size["v_mm"] / 2
    groove, slit = size["groove_mm"], 1.5
    low, high = 0.3 * b, 0.3 * b + groove
    right = [(a, 0), (a, low), (a - groove, low), (a - groove, high), (a, high), (a, b), (v, b)]
    section = o.mirrored([*right, (slit, b - v + slit), (slit, b - v - 2)])
    return o.along_x(section, 0, length).solid()


def step_block(size: dict[str, float]) -> s.Solid:
    """A stair along x for clamping."""
    a, b, w, steps = size["a_mm"], size["b_mm"], size["w_mm"] / 2, int(size["steps"])
    foot = 0.25 * b
    outline = [(0.0, 0.0), (a, 0.0)]
    for n in range(steps):
        z = foot + (b - foot) * n / (steps - 1)
        outline += [(a * (1 - n / steps), z), (a * (1 - (n + 1) / steps), z)]
    return o.along_y(outline, -w, w).solid()


def soft_jaw(size: dict[str, float]) -> s.Solid:
    """A vice jaw along x with two counterbored holes and a step along its upper edge."""
    a, b, w, step = size["a_mm"] / 2, size["b_mm"], size["w_mm"], size["step_mm"]
    jaw = o.along_x([(0, 0), (w, 0), (w, b), (step, b), (step, b - step), (0, b - step)], -a, a)
    for x in (-0.55 * a, 0.55 * a):
        jaw = jaw.drilled(s.drill(size["hole_mm"] / 2, (x, -1, 0.4 * b), "y", w + 2))
    return jaw.solid()


def gripper_finger(size: dict[str, float]) -> s.Solid:
    """A finger: a foot along x with two screw holes, an upright that tapers, a pad with a V at its tip."""
    a, b, w, t = size["a_mm"], size["b_mm"], size["w_mm"] / 2, size["t_mm"]
    tip, pad, v = size["tip_mm"], size["pad_mm"], size["v_mm"]
    foot = h.block(0, a, -w, w, 0, t)
    for x in (0.55 * a, 0.84 * a):
        foot = foot.drilled(s.drill(size["hole_mm"] / 2, (x, 0, -1), "z", t + 2))
    upright = o.along_y([(0, 0), (1.4 * t, 0), (tip, b), (0, b)], -w, w)
    outline = [(0, b - pad), (0, b), (-tip, b), (-tip, b - pad / 2 + v)]
    outline += [(v - tip, b - pad / 2), (-tip, b - pad / 2 - v), (-tip, b - pad)]
    return (foot + upright + o.along_y(outline[::-1], -w, w)).solid()


def clamp_strap(size: dict[str, float]) -> s.Solid:
    """A clamping strap along x with a slot; its nose is bevelled, a heel stands below its other end."""
    length, w, t, half = size["l_mm"], size["w_mm"] / 2, size["t_mm"], size["slot_mm"] / 2
    outline = s.rectangle(0, 0.75 * length, -w, w)
    window = o.slot(0.2 * length + half, 0.75 * length - 2 * half, 0, half)
    nose = o.along_y(
        [(0.75 * length, 0), (length, 0), (length, 0.45 * t), (0.85 * length, t), (0.75 * length, t)], -w, w
    )
    heel = h.block(0, 0.14 * length, -w, w, -size["heel_mm"], t / 2)
    return (o.pierced(outline, 0, t, [window]) + nose + heel).solid()


def saddle_clamp(size: dict[str, float]) -> s.Solid:
    """A two-hole strap: half a ring over a pipe along y, and a foot with a screw hole on either side."""
    d, w, t, foot = size["d_mm"] / 2, size["w_mm"] / 2, size["t_mm"], size["foot_mm"]
    reach = d + t + foot
    count = s.sides_for(d, 0.12, 4, 12, 24) // 2
    edges = np.linspace(0, np.pi, count + 1)
    hulls = [_ring_piece(d, d + t, a0, a1, -w, w) for a0, a1 in zip(edges[:-1], edges[1:], strict=True)]
    outer, inner = o.arch(d + t, 0, 0), o.arch(d, 0, 0)
    bow = np.concatenate([outer[2:], inner[2:][::-1]])
    body = s.extrude(bow, -w, w).rotate((90.0, 0.0, 0.0))
    shape = h.tool(body, hulls)
    for x0, x1 in ((d, reach), (-reach, -d)):
        ear = h.block(x0, x1, -w, w, 0, t)
        middle = (x0 + x1) / 2 + np.sign(x0) * t / 2
        shape += ear.drilled(s.drill(size["hole_mm"] / 2, (middle, 0, -1), "z", t + 2))
    return shape.solid()


def p_clip(size: dict[str, float]) -> s.Solid:
    """A ring along y, closed at its tail, where two straps lie on each other with one hole."""
    d, w, t, tail = size["d_mm"] / 2, size["w_mm"] / 2, size["t_mm"], size["tail_mm"]
    body = s.extrude(s.circle(d + t), -w, w, [s.circle(d)]).rotate((90.0, 0.0, 0.0))
    ring = [points[:, [0, 2, 1]] for points in o.hollow(d, d + t, -w, w)]
    z0 = -d - t
    strap = h.block(0, d + t + tail, -w, w, z0, z0 + 2 * t)
    cut = strap - o.bore(d, -w - 1, w + 1).turned("x", 90)
    hole = s.drill(size["hole_mm"] / 2, (d + t + tail / 2, 0, z0 - 1), "z", 2 * t + 2)
    return (h.tool(body, ring) + cut.drilled(hole)).solid()


def pipe_clamp(size: dict[str, float]) -> s.Solid:
    """A clamp block of two halves, a gap between them, its bore along y, two bolt holes from above."""
    a, b, w, d, gap = size["a_mm"] / 2, size["b_mm"] / 2, size["w_mm"] / 2, size["d_mm"] / 2, 0.6
    web = 0.3 * w
    halves = h.plate(o.blunted(-a, a, -b, b, 0.3 * b), -w, w, [(0, 0, d)])
    notch = h.block(d, a + 1, -gap, gap, -w - 1, web) + h.block(-a - 1, -d, -gap, gap, -w - 1, web)
    clamp = halves.drilled(notch).turned("x", 90)
    for x in ((a + d) / 2, -(a + d) / 2):
        hole = o.bore(size["hole_mm"] / 2, -b - 1, b + 1).moved(x=x)
        # Of a small clamp the bolt holes are a tenth; a large one's hulls fill them.
        clamp = clamp - hole if 2 * b < 35 else clamp.drilled(hole)
    return clamp.solid()


def split_clamp(size: dict[str, float]) -> s.Solid:
    """A clamp for rods along x: a bore at one end with a slit out of it, a tail with a hole across."""
    length, w, t, d = size["l_mm"], size["w_mm"] / 2, size["t_mm"] / 2, size["d_mm"] / 2
    slit, hole = size["slit_mm"] / 2, size["hole_mm"] / 2
    outline = o.together(s.circle(w), s.rectangle(0, length - w, -w, w))
    clamp = h.plate(outline, -t, t, [(0, 0, d)])
    opened = clamp - h.block(0.5 * d, 0.62 * length, -slit, slit, -t - 1, t + 1)
    cross = s.drill(hole, (0.5 * (0.62 * length + d), -w - 1, 0), "y", 2 * w + 2)
    return opened.drilled(cross, s.drill(hole, (length - 1.35 * w, 0, -t - 1), "z", 2 * t + 2)).solid()


def _ring_piece(inner: float, outer: float, a0: float, a1: float, y0: float, y1: float) -> np.ndarray:
    """A sector of a ring about y between two angles in x and z."""
    angles = np.linspace(a0, a1, 5)
    out = outer * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    swell = 2 / (1 + np.cos((a1 - a0) / 2))
    chord = inner * swell * np.stack([np.cos(angles[[-1, 0]]), np.sin(angles[[-1, 0]])], axis=1)
    return s.prism(np.concatenate([out, chord]), y0, y1)[:, [0, 2, 1]]
