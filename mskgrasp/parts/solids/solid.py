"""Solids in millimetres: watertight meshes made by manifold3d, with convex pieces that represent them.

Families use millimetres, as their standards do. A convex piece is an (n, 3) array of corner points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
import trimesh
from manifold3d import CrossSection, FillRule, Manifold
from scipy.spatial import ConvexHull, QhullError

CIRCLE_SEGMENTS = 128
"""Number of sides of round mesh surfaces: an inscribed 128-gon has 0.04 % less area than its circle."""

ROUND_TOLERANCE_MM = 0.1
"""Largest distance of a round hull's facets from the true circle, to either side."""

BORE_TOLERANCE_MM = 0.25
"""The same for bores, where each facet costs a wedge, and which fingers do not enter."""

MAX_HULL_VERTICES = 32
"""PhysX on a GPU silently reduces hulls of more than 64 faces; a hull of 32 vertices has at most 60."""


@dataclass(frozen=True, kw_only=True)
class Solid:
    """A part's watertight mesh and the convex pieces used for collision, millimetres."""

    mesh: trimesh.Trimesh
    hulls: tuple[np.ndarray, ...]


def polygon(radius: float, sides: int, phase: float = 0.0) -> np.ndarray:
    """Corners (sides, 2) of a regular polygon inscribed in a circle; the first at angle ``phase``."""
    angle = phase + 2 * np.pi * np.arange(sides) / sides
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def hexagon(across_flats: float) -> np.ndarray:
    """Corners (6, 2) of a hexagon with flats facing +y and -y."""
    return polygon(across_flats / np.sqrt(3), 6)


def rectangle(x0: float, x1: float, y0: float, y1: float) -> np.ndarray:
    """Corners (4, 2), counter-clockwise."""
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], dtype=float)


def balanced_polygon(
    radius: float, sides: int, phase: float = 0.0, centre: Sequence[float] = (0.0, 0.0)
) -> np.ndarray:
    """A polygon whose corners lie as far outside the circle as its edges lie inside."""
    return polygon(2 * radius / (1 + np.cos(np.pi / sides)), sides, phase) + np.asarray(centre)


def sides_for(radius: float, tolerance: float, multiple: int, least: int, most: int) -> int:
    """Fewest sides, a multiple of ``multiple``, that keep a balanced polygon within the tolerance."""
    for sides in range(least, most, multiple):
        cos = np.cos(np.pi / sides)
        if radius * (1 - cos) / (1 + cos) <= tolerance:
            return sides
    return most


def bore_polygon(radius: float, multiple: int = 2, centre: Sequence[float] = (0.0, 0.0)) -> np.ndarray:
    """The polygon that represents a bore in the hulls: 8 to 16 sides (6 to 18 in multiples of six)."""
    least = 8 if multiple == 2 else multiple
    return balanced_polygon(radius, sides_for(radius, BORE_TOLERANCE_MM, multiple, least, 16), centre=centre)


def prism(outline: np.ndarray, z0: float, z1: float) -> np.ndarray:
    """Corner points of an outline (n, 2) extruded from z0 to z1."""
    return np.concatenate([np.column_stack([outline, np.full(len(outline), z)]) for z in (z0, z1)])


def box(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float) -> np.ndarray:
    """Corner points of a box."""
    return prism(rectangle(x0, x1, y0, y1), z0, z1)


def rod(radius: float, z0: float, z1: float, multiple: int = 4) -> list[np.ndarray]:
    """A cylinder about z as one prism, or as two halves where one would be too coarse.

    Args:
        radius: Radius of the true cylinder.
        z0: Lower end.
        z1: Upper end.
        multiple: The number of sides is a multiple of it (6 to agree with a hexagon).
    """
    most = 30 if multiple == 6 else 28
    sides = sides_for(radius, ROUND_TOLERANCE_MM, multiple, 12, most)
    corners = balanced_polygon(radius, sides)
    if 2 * sides <= MAX_HULL_VERTICES:
        return [prism(corners, z0, z1)]
    half = sides // 2
    closed = np.concatenate([corners, corners[:1]])
    return [prism(closed[: half + 1], z0, z1), prism(closed[half:], z0, z1)]


def frustum(radius0: float, radius1: float, z0: float, z1: float, sides: int = 16) -> np.ndarray:
    """A truncated cone about z."""
    lower, upper = balanced_polygon(radius0, sides), balanced_polygon(radius1, sides)
    return np.concatenate(
        [np.column_stack([lower, np.full(sides, z0)]), np.column_stack([upper, np.full(sides, z1)])]
    )


def around_hole(outline: np.ndarray, hole: np.ndarray, z0: float, z1: float) -> list[np.ndarray]:
    """The convex pieces of a convex plate with a convex hole: one for each side of the hole.

    Args:
        outline: (n, 2) convex.
        hole: (m, 2) convex, inside the outline.
        z0: Lower face.
        z1: Upper face.
    """
    centre = hole.mean(axis=0)
    reach = 1e3
    plate = shapely.Polygon(outline)
    pieces = []
    for a, b in zip(hole, np.roll(hole, -1, axis=0), strict=True):
        sector = shapely.Polygon([a, b, centre + reach * (b - centre), centre + reach * (a - centre)])
        piece = plate.intersection(sector)
        pieces.append(prism(np.asarray(shapely.get_coordinates(piece))[:-1], z0, z1))
    return pieces


def round_outline(radius: float, multiple: int) -> np.ndarray:
    """A circle as the outline of a plate to be split: 24 sides or more."""
    sides = sides_for(radius, ROUND_TOLERANCE_MM, multiple, -(-24 // multiple) * multiple, 96)
    return balanced_polygon(radius, sides)


def ring(outer_radius: float, bore_radius: float, z0: float, z1: float) -> list[np.ndarray]:
    """The convex pieces of a ring about z."""
    hole = bore_polygon(bore_radius)
    return around_hole(round_outline(outer_radius, len(hole)), hole, z0, z1)


def cut(
    hulls: Iterable[np.ndarray], normals: Iterable[np.ndarray], offsets: Iterable[float]
) -> list[np.ndarray]:
    """Hulls with everything beyond the planes ``normal . x = offset`` cut off."""
    planes = list(zip(normals, offsets, strict=True))
    result = []
    for points in hulls:
        body = Manifold.hull_points(np.asarray(points, dtype=np.float64))
        for normal, offset in planes:
            # trim_by_plane keeps the side that the normal points to.
            body = body.trim_by_plane(tuple(-np.asarray(normal, dtype=float)), -offset)
        result.append(np.asarray(body.to_mesh64().vert_properties)[:, :3])
    return result


def few_corners(points: np.ndarray) -> np.ndarray:
    """Corners of a convex body near the hull of the points: those that stand out farthest are kept."""
    corners = points[np.sort(ConvexHull(points).vertices)]
    if len(corners) <= MAX_HULL_VERTICES:
        return corners
    spread = np.linalg.norm(corners - corners.mean(axis=0), axis=1)
    first = {int((sign * corners[:, axis]).argmax()) for axis in range(3) for sign in (1, -1)}
    chosen = sorted(first | {int(spread.argmax())})
    while len(chosen) < MAX_HULL_VERTICES:
        try:
            planes = ConvexHull(corners[chosen]).equations
        except QhullError:  # the first few may lie in a plane
            outside = _distance_off_plane(corners, corners[chosen])
        else:
            outside = (corners @ planes[:, :3].T + planes[:, 3]).max(axis=1)
        outside[chosen] = -1
        chosen.append(int(outside.argmax()))
    return corners[sorted(chosen)]


def _distance_off_plane(points: np.ndarray, flat: np.ndarray) -> np.ndarray:
    """Distance (n,) of points from the plane through nearly coplanar ones."""
    centre = flat.mean(axis=0)
    normal = np.linalg.svd(flat - centre)[2][-1]
    return np.abs((points - centre) @ normal)


def move(
    points: np.ndarray, *, turn: np.ndarray | None = None, by: Sequence[float] = (0, 0, 0)
) -> np.ndarray:
    """Points (n, 3) turned by a rotation matrix, then shifted."""
    turned = points if turn is None else points @ np.asarray(turn).T
    return turned + np.asarray(by, dtype=float)


def extrude(outline: np.ndarray, z0: float, z1: float, holes: Sequence[np.ndarray] = ()) -> Manifold:
    """A plate with through holes, as a mesh body."""
    section = CrossSection(
        [np.asarray(loop, dtype=np.float64) for loop in (outline, *holes)], FillRule.EvenOdd
    )
    return section.extrude(z1 - z0).translate((0.0, 0.0, z0))


def circle(radius: float, centre: Sequence[float] = (0.0, 0.0)) -> np.ndarray:
    """A circle as a polygon of the mesh."""
    return polygon(radius, CIRCLE_SEGMENTS) + np.asarray(centre)


def lathe(profile: Sequence[tuple[float, float]]) -> Manifold:
    """A body of revolution about z from its half profile, (radius, z) corners in order."""
    corners = np.asarray(profile, dtype=np.float64)
    section = CrossSection([corners], FillRule.EvenOdd)
    return section.revolve(CIRCLE_SEGMENTS)


def drill(radius: float, start: Sequence[float], axis: str, length: float) -> Manifold:
    """A cylinder to be subtracted: from ``start`` along +x, +y or +z."""
    turn = {"x": (0.0, 90.0, 0.0), "y": (-90.0, 0.0, 0.0), "z": (0.0, 0.0, 0.0)}[axis]
    x, y, z = (float(value) for value in start)
    return extrude(circle(radius), 0.0, length).rotate(turn).translate((x, y, z))


def solid(body: Manifold, hulls: Iterable[np.ndarray]) -> Solid:
    """Pair a body with its convex pieces."""
    data = body.to_mesh64()
    mesh = trimesh.Trimesh(
        np.asarray(data.vert_properties)[:, :3], np.asarray(data.tri_verts), process=False, validate=False
    )
    return Solid(mesh=mesh, hulls=tuple(np.asarray(points, dtype=float) for points in hulls))


Maker = Callable[[dict[str, float]], Solid]
