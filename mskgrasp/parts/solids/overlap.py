"""Convex pieces extended into their neighbours, so that no contact is made with the face between two."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from manifold3d import Manifold, OpType
from scipy.spatial import ConvexHull, QhullError

from mskgrasp.parts.solids.measure import MOST_ASPECT_RATIO, aspect_ratio
from mskgrasp.parts.solids.solid import MAX_HULL_VERTICES

REACH_MM = 1.0
"""Depth to which a piece reaches into its neighbours: far more than a pad sinks into a part."""

_TOUCH_MM = 0.05
"""Pieces that are no farther apart, and overlap by no more, touch."""
_FLAT_MM = 0.01
"""A corner that protrudes by less from the hull of the others is dropped: PhysX would drop it, too."""
_OUTSIDE = 1e-3
"""Largest share of the volume that a corner adds that may lie outside all pieces."""
_CERTAIN = 1.01
"""A bound that exceeds it by this factor settles the matter without the exact volume."""
_FACES, _SHARES = 8, (0.05, 0.3, 0.7)
"""The bound is that of so many faces, and of points at these shares of the way from a face to the corner."""
_GUARD_MM = 1e-3
"""Distance from a plane within which a point does not count as before it; planes are rounded."""


def overlapped(hulls: Sequence[np.ndarray]) -> list[np.ndarray]:
    """The pieces, each with as much of the neighbours that it touches as leaves their union unchanged.

    A contact pushes along the shortest way out of a piece. Where two pieces meet at a face, that way leads
    through this face for a corner of a pad that presses near it: sideways, as if the part had a step there.

    Args:
        hulls: Corners (n, 3) of each piece, mm.

    Returns:
        As many pieces in the same order. An extension that fills a concave side, needs too many corners,
        or makes a piece more slender than PhysX accepts, is left out.
    """
    pieces = [np.asarray(points, dtype=float) for points in hulls]
    bodies = [Manifold.hull_points(points) for points in pieces]
    sides = [np.unique(np.round(ConvexHull(points).equations, 6), axis=0) for points in pieces]
    boxes = [(points.min(axis=0) - _TOUCH_MM, points.max(axis=0) + _TOUCH_MM) for points in pieces]
    found = []
    for number, points in enumerate(pieces):
        low, high = boxes[number]
        near = [
            other
            for other in range(len(pieces))
            if other != number and (boxes[other][0] <= high).all() and (boxes[other][1] >= low).all()
        ]
        slices = []
        for other in near:
            plane = _plane_between(sides[number], pieces[other])
            if plane is not None:
                slices.append(_slice(bodies[other], *plane))
        here = [number, *near]
        union = Manifold.batch_boolean([bodies[n] for n in here], OpType.Add)
        extended = _extended(points, slices, union, [sides[n] for n in here])
        found.append(_without_flat_corners(extended))
    return found


def _slice(body: Manifold, normal: np.ndarray, offset: float) -> np.ndarray:
    """Corners (n, 3), beyond a plane, of the slice of a body that reaches `REACH_MM` beyond it."""
    # trim_by_plane keeps the side that the normal points to.
    slab = body.trim_by_plane(tuple(-normal), -(offset + REACH_MM))
    corners = np.asarray(slab.to_mesh64().vert_properties)[:, :3]
    return corners[corners @ normal > offset + 1e-3]


def _extended(
    points: np.ndarray, slices: Sequence[np.ndarray], union: Manifold, sides: Sequence[np.ndarray]
) -> np.ndarray:
    """Points (n, 3) and those corners of the neighbours' slices that keep the union unchanged.

    Args:
        points: Of the piece.
        slices: Corners (k, 3) of the slice of each neighbour.
        union: Of the piece and all its neighbours.
        sides: Planes (m, 4) of each of these.
    """
    corners = np.concatenate([np.zeros((0, 3)), *slices])
    if not len(corners):
        return points
    hull = ConvexHull(points)
    # What is outside only grows with the piece, so that the bound need not be computed again.
    outside, added = _least_outside(hull, corners, sides), _added(hull, corners).sum(axis=1)
    volume, number = Manifold.hull_points(points).volume(), -1
    for one in slices:
        most_slender = max(0.9 * MOST_ASPECT_RATIO, aspect_ratio(points))
        for corner in one:
            number += 1
            if outside[number] > _CERTAIN * _OUTSIDE * added[number]:
                continue
            grown = np.concatenate([points, corner[None]])
            grown = grown[np.sort(ConvexHull(grown).vertices)]
            if len(grown) > MAX_HULL_VERTICES or aspect_ratio(grown) > most_slender:
                continue
            extended = Manifold.hull_points(grown)
            more = extended.volume() - volume
            if more > 0 and (extended - union).volume() <= _OUTSIDE * more:
                points, volume = grown, extended.volume()
                added = _added(ConvexHull(points), corners).sum(axis=1)
    return points


def _added(hull: ConvexHull, corners: np.ndarray) -> np.ndarray:
    """Volume (k, n) that each of the corners (k, 3) adds to a hull over each of its n faces."""
    a, b, c = np.moveaxis(hull.points[hull.simplices], 1, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    heights = corners @ hull.equations[:, :3].T + hull.equations[:, 3]
    return np.maximum(heights, 0) * areas / 3


def _least_outside(hull: ConvexHull, corners: np.ndarray, sides: Sequence[np.ndarray]) -> np.ndarray:
    """Lower bound (k,) of the volume that lies outside all bodies of what each corner (k, 3) adds to a hull.

    A corner adds a tetrahedron over each face that sees it. Where a point in it lies outside all bodies, a
    plane of each body has this point before it, and what is before all these planes is convex: it holds the
    tetrahedron shrunk towards the point, along each edge as far as the planes allow.
    """
    over = _added(hull, corners)
    most = min(_FACES, over.shape[1])
    faces = np.argpartition(over, -most, axis=1)[:, -most:]
    volumes = np.take_along_axis(over, faces, axis=1)
    tips = np.broadcast_to(corners[:, None, None], (*faces.shape, 1, 3))
    tetrahedra = np.concatenate([hull.points[hull.simplices[faces]], tips], axis=2).reshape(-1, 4, 3)
    planes = np.concatenate(sides)
    first = np.cumsum([0, *map(len, sides)])
    before = tetrahedra @ planes[:, :3].T + planes[:, 3] - _GUARD_MM
    best = np.zeros(len(tetrahedra))
    for share in _SHARES:
        weights = np.array([*[(1 - share) / 3] * 3, share])
        at = np.einsum("v,nvp->np", weights, before)
        chosen = np.stack([a + at[:, a:b].argmax(axis=1) for a, b in pairwise(first)], axis=1)
        gap = np.take_along_axis(at, chosen, axis=1)
        free = np.flatnonzero(gap.min(axis=1) > 0)
        gap = gap[free, None]
        ends = np.take_along_axis(before[free], chosen[free, None], axis=2)
        reach = np.where(ends < 0, gap / np.maximum(gap - ends, gap), 1.0).min(axis=2)
        # Split at the point into four, each with three of the shrunk edges.
        shrunk = (weights * reach.prod(axis=1, keepdims=True) / reach).sum(axis=1)
        best[free] = np.maximum(best[free], shrunk)
    return (volumes * best.reshape(volumes.shape)).sum(axis=1)


def _plane_between(sides: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, float] | None:
    """The side (outward normal, offset), of planes (k, 4), beyond which a body lies that touches it."""
    beyond = (other @ sides[:, :3].T + sides[:, 3]).min(axis=0)
    best = int(beyond.argmax())
    return (sides[best, :3], -float(sides[best, 3])) if abs(beyond[best]) < _TOUCH_MM else None


def _without_flat_corners(points: np.ndarray) -> np.ndarray:
    """The corners without those that an extension has left on an edge or a face."""
    number = 0
    while number < len(points):
        others = np.delete(points, number, axis=0)
        try:
            outside = (ConvexHull(others).equations @ [*points[number], 1.0]).max()
        except QhullError:
            outside = np.inf  # without the apex of a pyramid the others lie in a plane
        if outside < _FLAT_MM:
            points = others
        else:
            number += 1
    return points
