"""Outlines and bars that angular families share; millimetres."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import shapely

from mskgrasp.parts import shape as h
from mskgrasp.parts import solid as s
from mskgrasp.parts.pieces import convex_polygons

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


def _corners(region: Any) -> np.ndarray:
    return np.asarray(shapely.get_coordinates(shapely.normalize(region).exterior))[:-1][::-1]
