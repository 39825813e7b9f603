"""Cut lengths of extruded and rolled profiles, along x."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import shapely

from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.listing import one_per_row
from mskgrasp.parts.recipes.recipe import ALUMINIUM, Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.measure import aspect_ratio
from mskgrasp.parts.solids.pieces import convex_polygons

MOST_SLENDER = 45.0
"""Largest ratio of length to thickness of a hull, below the limit of PhysX on a GPU."""


def recipes() -> Iterator[Recipe]:
    """The built-in profiles."""
    yield from one_per_row("slot_profile.csv", "slot_profile_{a}x{b}x{l}", slot_profile, density=ALUMINIUM)
    yield from one_per_row("channel.csv", "channel_{a}x{b}x{l}", channel, density=ALUMINIUM)
    yield from one_per_row("lipped_channel.csv", "lipped_channel_{a}x{b}x{l}", lipped_channel)
    yield from one_per_row("angle_profile.csv", "angle_profile_{a}x{b}x{l}", angle_profile, density=ALUMINIUM)
    yield from one_per_row("tee_profile.csv", "tee_profile_{a}x{b}x{l}", tee_profile)
    yield from one_per_row("i_beam.csv", "i_beam_{a}x{b}x{l}", i_beam, density=ALUMINIUM)
    yield from one_per_row("square_tube.csv", "square_tube_{a}x{b}x{l}", square_tube)
    yield from one_per_row("din_rail.csv", "din_rail_{a}x{b}x{l}", din_rail, source="EN 60715")
    yield from one_per_row("dovetail_rail.csv", "dovetail_rail_{a}x{b}x{l}", dovetail_rail)
    yield from one_per_row("linear_rail.csv", "linear_rail_{a}x{b}x{l}", linear_rail)


def slot_profile(size: dict[str, float]) -> s.Solid:
    """An aluminium profile with a T-slot in the middle of every module of its four sides."""
    module, a, b = size["module_mm"], size["a_mm"], size["b_mm"]
    opening, lip, under, deep = size["slot_mm"] / 2, size["lip_mm"], size["under_mm"] / 2, size["deep_mm"]
    cutter = shapely.Polygon(
        [
            (-opening, 1),
            (-opening, -lip),
            (-under, -lip),
            (-under, -lip - 0.25 * (deep - lip)),
            (-opening, -deep),
            (opening, -deep),
            (under, -lip - 0.25 * (deep - lip)),
            (under, -lip),
            (opening, -lip),
            (opening, 1),
        ]
    )
    section: Any = shapely.Polygon(s.rectangle(-a / 2, a / 2, -b / 2, b / 2))
    for side, width, height in ((0, a, b), (90, b, a), (180, a, b), (270, b, a)):
        for n in range(round(width / module)):
            x = (n + 0.5) * module - width / 2
            placed = shapely.transform(cutter, lambda p, x=x, height=height: p + [x, height / 2])
            turned = shapely.transform(placed, lambda p, side=side: _rotate(p, side))
            section = section.difference(turned)
    bores = [(x, y) for x in _middles(a, module) for y in _middles(b, module)]
    outline = np.asarray(shapely.get_coordinates(section.exterior))[:-1]
    windows = [s.circle(size["bore_mm"] / 2, centre) for centre in bores]
    hulls = [s.prism(piece, 0, size["l_mm"]) for piece in convex_polygons(section)]
    return _laid(h.tool(s.extrude(outline, 0, size["l_mm"], windows), hulls))


def channel(size: dict[str, float]) -> s.Solid:
    """A U-profile, open upwards."""
    a, b, t = size["a_mm"] / 2, size["b_mm"], size["t_mm"]
    section = o.mirrored([(a, 0), (a, b), (a - t, b), (a - t, t)])
    return _finished(o.along_x(section, 0, size["l_mm"]))


def lipped_channel(size: dict[str, float]) -> s.Solid:
    """A C-profile (strut channel): its walls end in lips that turn inward and down."""
    a, b, t, lip, back = size["a_mm"] / 2, size["b_mm"], size["t_mm"], size["lip_mm"], size["back_mm"]
    inner = [(a - lip, b), (a - lip, b - back), (a - lip + t, b - back), (a - lip + t, b - t)]
    section = o.mirrored([(a, 0), (a, b), *inner, (a - t, b - t), (a - t, t)])
    return _finished(o.along_x(section, 0, size["l_mm"]))


def angle_profile(size: dict[str, float]) -> s.Solid:
    """An L-profile with legs of equal thickness."""
    a, b, t = size["a_mm"], size["b_mm"], size["t_mm"]
    return _finished(o.along_x([(0, 0), (a, 0), (a, t), (t, t), (t, b), (0, b)], 0, size["l_mm"]))


def tee_profile(size: dict[str, float]) -> s.Solid:
    """A T-profile, its flange below."""
    a, b, t = size["a_mm"] / 2, size["b_mm"], size["t_mm"]
    section = o.mirrored([(a, 0), (a, t), (t / 2, t), (t / 2, b)])
    return _finished(o.along_x(section, 0, size["l_mm"]))


def i_beam(size: dict[str, float]) -> s.Solid:
    """An I-profile; its web is as thick as its flanges."""
    a, b, t = size["a_mm"] / 2, size["b_mm"], size["t_mm"]
    section = o.mirrored([(a, 0), (a, t), (t / 2, t), (t / 2, b - t), (a, b - t), (a, b)])
    return _finished(o.along_x(section, 0, size["l_mm"]))


def square_tube(size: dict[str, float]) -> s.Solid:
    """A square or rectangular tube with a cross hole near one end, filled in the hulls."""
    a, b, t, length = size["a_mm"] / 2, size["b_mm"] / 2, size["t_mm"], size["l_mm"]
    tube = o.pierced(s.rectangle(-a, a, -b, b), 0, length, [s.rectangle(t - a, a - t, t - b, b - t)])
    hole = s.drill(size["hole_mm"] / 2, (0, -b - 1, 1.2 * min(2 * a, 2 * b) / 2), "y", 2 * b + 2)
    return _laid(tube.drilled(hole))


def din_rail(size: dict[str, float]) -> s.Solid:
    """A top-hat rail, its lips above."""
    a, b, t, inner = size["a_mm"] / 2, size["b_mm"], size["t_mm"], size["inner_mm"] / 2
    section = o.mirrored([(inner, 0), (inner, b - t), (a, b - t), (a, b), (inner - t, b), (inner - t, t)])
    return _finished(o.along_x(section, 0, size["l_mm"]))


def dovetail_rail(size: dict[str, float]) -> s.Solid:
    """A rail with a dovetail of 60 degrees above its foot."""
    a, b, foot, neck = size["a_mm"] / 2, size["b_mm"], size["foot_mm"], size["neck_mm"] / 2
    flare = (b - foot) / np.tan(np.radians(60))
    section = o.mirrored([(a, 0), (a, foot), (neck, foot), (neck + flare, b)])
    rail = o.along_x(section, 0, size["l_mm"])
    for x in (0.2, 0.8):
        rail = rail.drilled(s.drill(size["hole_mm"] / 2, (x * size["l_mm"], 0, -1), "z", b + 2))
    return rail.solid()


def linear_rail(size: dict[str, float]) -> s.Solid:
    """A guide rail with a ball groove along either flank and counterbored holes, filled in the hulls."""
    a, b, length, groove = size["a_mm"] / 2, size["b_mm"], size["l_mm"], size["groove_mm"]
    low, high = 0.5 * b, 0.85 * b
    middle = (low + high) / 2
    section = o.mirrored([(a, 0), (a, low), (a - groove, middle), (a, high), (a - 0.3, b)])
    rail = o.along_x(section, 0, length)
    for n in range(int(size["holes"])):
        x = length * (n + 0.5) / size["holes"]
        rail = rail.drilled(
            s.drill(size["hole_mm"] / 2, (x, 0, -1), "z", b + 2),
            s.drill(0.9 * size["hole_mm"], (x, 0, 0.6 * b), "z", b),
        )
    return rail.solid()


def _middles(width: float, module: float) -> list[float]:
    return [(n + 0.5) * module - width / 2 for n in range(round(width / module))]


def _rotate(points: np.ndarray, degrees: int) -> np.ndarray:
    cos, sin = round(np.cos(np.radians(degrees))), round(np.sin(np.radians(degrees)))
    return points @ np.array([[cos, sin], [-sin, cos]])


def _laid(upright: h.Shape) -> s.Solid:
    """A shape extruded along z, turned to lie along x."""
    return _finished(upright.turned("y", 90).turned("x", 90))


def _finished(bar: h.Shape) -> s.Solid:
    """A bar along x; pieces too slender for PhysX are cut across."""
    merged = bar.solid()
    return s.solid(bar.body, [part for points in merged.hulls for part in _split_slender(points)])


def _split_slender(points: np.ndarray) -> list[np.ndarray]:
    if aspect_ratio(points) <= MOST_SLENDER:
        return [points]
    middle = float(points[:, 0].min() + points[:, 0].max()) / 2
    along = np.array([1.0, 0.0, 0.0])
    halves = s.cut([points], [along], [middle]) + s.cut([points], [-along], [-middle])
    return [part for half in halves for part in _split_slender(half)]
