"""Shared outlines and bars of angular families; millimetres."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import shapely

from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.pieces import convex_polygons

_QUARTER = s.CIRCLE_SEGMENTS // 4


def along_x(outline_yz: np.ndarray | Sequence[Sequence[float]], x0: float, x1: float) -> h.Shape:
    """A bar along x with a given cross-section (n, 2) in y and z."""
    return h.plate(np.asarray(outline_yz, dtype=float), x0, x1).turned("y", 90).turned("x", 90)


def along_y(outline_xz: np.ndarray | Sequence[Sequence[float]], y0: float, y1: float) -> h.Shape:
    """A bar along y with a given cross-section (n, 2) in x and z."""
    return h.plate(np.asarray(outline_xz, dtype=float), -y1, -y0).turned("x", 90)


def pierced(outline: np.ndarray, z0: float, z1: float, windows: Iterable[np.ndarray]) -> h.Shape:
    """A plate whose windows, polygons (n, 2) of any shape, are open in the hulls, too."""
    windows = tuple(windows)
    region = shapely.Polygon(outline).simplify(h.HULL_DETAIL_MM)
    for window in windows:
        region = region.difference(shapely.Polygon(window).simplify(s.BORE_TOLERANCE_MM))
    hulls = [s.prism(piece, z0, z1) for piece in convex_polygons(region)]
    return h.tool(s.extrude(outline, z0, z1, windows), hulls)


def slot(x0: float, x1: float, y: float, radius: float) -> np.ndarray:
    """A slot along x with round ends about (x0, y) and (x1, y)."""
    return belt((x0, y, radius), (x1, y, radius))


def belt(*discs: tuple[float, float, float]) -> np.ndarray:
    """The convex outline around discs (x, y, radius)."""
    circles = [shapely.Polygon(s.circle(radius, (x, y))) for x, y, radius in discs]
    return _corners(shapely.union_all(circles).convex_hull)


def together(*outlines: np.ndarray) -> np.ndarray:
    """The outline of overlapping outlines; it must have no holes."""
    return _corners(shapely.union_all([shapely.Polygon(outline) for outline in outlines]))


def rounded(x0: float, x1: float, y0: float, y1: float, radius: float) -> np.ndarray:
    """A rectangle with rounded corners."""
    inner = [(x, y, radius) for x in (x0 + radius, x1 - radius) for y in (y0 + radius, y1 - radius)]
    return belt(*inner)


def blunted(x0: float, x1: float, y0: float, y1: float, radius: float) -> np.ndarray:
    """A rectangle with corners cut off: how hulls draw one with rounded corners."""
    c = 0.5 * radius
    right = [(x0 + c, y0), (x1 - c, y0), (x1, y0 + c), (x1, y1 - c)]
    return np.array([*right, (x1 - c, y1), (x0 + c, y1), (x0, y1 - c), (x0, y0 + c)])


def arch(half_width: float, z0: float, z1: float) -> np.ndarray:
    """Upright sides from z0 to z1 with a half circle on top."""
    angle = np.linspace(0, np.pi, 2 * _QUARTER + 1)
    top = np.stack([half_width * np.cos(angle), z1 + half_width * np.sin(angle)], axis=1)
    return np.concatenate([[[-half_width, z0], [half_width, z0]], top])


def mirrored(points: Sequence[Sequence[float]]) -> np.ndarray:
    """An outline from its right half (x >= 0), listed from below to above."""
    right = np.asarray(points, dtype=float)
    left = right[::-1] * [-1, 1]
    both = np.concatenate([right, left])
    return both[np.linalg.norm(both - np.roll(both, 1, axis=0), axis=1) > 1e-9]


def bore(radius: float, z0: float, z1: float) -> h.Shape:
    """A cylinder about z to cut out; it costs the hulls as few pieces as a bore may."""
    return h.tool(s.extrude(s.circle(radius), z0, z1), [s.prism(s.bore_polygon(radius), z0, z1)])


def tube(outer: float, inner: float, z0: float, z1: float) -> h.Shape:
    """A tube about z from its radii."""
    return h.turned([(inner, z0), (outer, z0), (outer, z1), (inner, z1)])


def wedges(inner: float, outer: float, z0: float, z1: float, sectors: int) -> list[np.ndarray]:
    """Convex pieces of a tube about z; the first is centred on the x axis.

    Args:
        inner: Radius at which the inner chords of the sectors end.
        outer: Radius, drawn with 24 sides or more.
        z0: Lower end.
        z1: Upper end.
        sectors: Number of pieces.
    """
    steps = -(-24 // sectors)
    swell_in, swell_out = (2 / (1 + np.cos(np.pi / sides)) for sides in (sectors, sectors * steps))
    pieces = []
    for sector in range(sectors):
        angles = 2 * np.pi * (sector - 0.5 + np.arange(steps + 1) / steps) / sectors
        round_side = outer * swell_out * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        ends = angles[[-1, 0]]
        chord = inner * swell_in * np.stack([np.cos(ends), np.sin(ends)], axis=1)
        pieces.append(s.prism(np.concatenate([round_side, chord]), z0, z1))
    return pieces


def hollow(bore: float, outer: float, z0: float, z1: float) -> list[np.ndarray]:
    """Convex pieces of a tube about z whose bore no finger enters: 8 to 12 of them."""
    return wedges(bore, outer, z0, z1, s.sides_for(bore, 0.45, 2, 8, 12))


def collar(bore: float, inner: float, outer: float, z0: float, z1: float) -> list[np.ndarray]:
    """Convex pieces of a ring about a tube: the chords of its few sectors lie hidden in the tube's wall."""
    sectors = next((n for n in (4, 6, 8) if inner * np.cos(np.pi / n) >= bore), 10)
    # The corners lie on the tube's surface: no swelling, or the chords would leave a gap.
    return wedges(inner * (1 + np.cos(np.pi / sectors)) / 2, outer, z0, z1, sectors)


def hexagonal_collar(inner: float, across_flats: float, z0: float, z1: float) -> list[np.ndarray]:
    """The same with a hexagonal outside, one piece for each flat."""
    outside, inside = s.hexagon(across_flats), s.polygon(inner, 6)
    pieces = []
    for n in range(6):
        m = (n + 1) % 6
        pieces.append(s.prism(np.array([outside[n], outside[m], inside[m], inside[n]]), z0, z1))
    return pieces


def _corners(region: Any) -> np.ndarray:
    return np.asarray(shapely.get_coordinates(shapely.normalize(region).exterior))[:-1][::-1]
