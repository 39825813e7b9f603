"""Convex pieces extended into their neighbours, so that no contact is made with the face between two."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from manifold3d import Manifold, OpType
from scipy.spatial import ConvexHull

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


def overlapped(hulls: Sequence[np.ndarray], reach_mm: float = REACH_MM) -> list[np.ndarray]:
    """The pieces, each with as much of the neighbours that it touches as leaves their union unchanged.

    A contact pushes along the shortest way out of a piece. Where two pieces meet at a face, that way leads
    through this face for a corner of a pad that presses near it: sideways, as if the part had a step there.

    Args:
        hulls: Corners (n, 3) of each piece, mm.
        reach_mm: Depth of the overlap, mm.

    Returns:
        As many pieces in the same order. An extension that fills a concave side, needs too many corners,
        or makes a piece more slender than PhysX accepts, is left out.
    """
    pieces = [np.asarray(points, dtype=float) for points in hulls]
    bodies = [Manifold.hull_points(points) for points in pieces]
    boxes = [(points.min(axis=0) - _TOUCH_MM, points.max(axis=0) + _TOUCH_MM) for points in pieces]
    found = []
    for number, points in enumerate(pieces):
        low, high = boxes[number]
        near = [
            other
            for other in range(len(pieces))
            if other != number and (boxes[other][0] <= high).all() and (boxes[other][1] >= low).all()
        ]
        union = Manifold.batch_boolean([bodies[n] for n in (number, *near)], OpType.Add)
        sides = np.unique(np.round(ConvexHull(points).equations, 6), axis=0)
        for other in near:
            plane = _plane_between(sides, pieces[other])
            if plane is not None:
                points = _extended(points, plane, bodies[other], union, reach_mm)
        found.append(_without_flat_corners(points))
    return found


def _extended(
    points: np.ndarray,
    plane: tuple[np.ndarray, float],
    body: Manifold,
    union: Manifold,
    reach_mm: float,
) -> np.ndarray:
    """Points (n, 3) and those corners of a neighbour's adjacent slice that keep the union unchanged.

    Args:
        points: Of the piece.
        plane: Normal and offset of its side beyond which the neighbour lies.
        body: The neighbour.
        union: Of the piece and all its neighbours.
        reach_mm: Depth of the slice.
    """
    normal, offset = plane
    # trim_by_plane keeps the side that the normal points to.
    slab = body.trim_by_plane(tuple(-normal), -(offset + reach_mm))
    if slab.is_empty():
        return points
    volume = Manifold.hull_points(points).volume()
    most_slender = max(0.9 * MOST_ASPECT_RATIO, aspect_ratio(points))
    corners = np.asarray(slab.to_mesh64().vert_properties)[:, :3]
    for corner in corners[corners @ normal > offset + 1e-3]:
        grown = np.concatenate([points, corner[None]])
        grown = grown[np.sort(ConvexHull(grown).vertices)]
        if len(grown) > MAX_HULL_VERTICES or aspect_ratio(grown) > most_slender:
            continue
        extended = Manifold.hull_points(grown)
        added = extended.volume() - volume
        if added > 0 and (extended - union).volume() <= _OUTSIDE * added:
            points, volume = grown, extended.volume()
    return points


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
        if (ConvexHull(others).equations @ [*points[number], 1.0]).max() < _FLAT_MM:
            points = others
        else:
            number += 1
    return points
