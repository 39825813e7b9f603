"""Triangulation of polygons in mesh files."""

from __future__ import annotations

import numpy as np
from manifold3d import triangulate


def triangulated(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Triangles (n - 2, 3) of a polygon (n,) of indices into points, wound as the polygon is.

    A convex polygon becomes a fan; of a concave one a fan would fold over itself. References to missing
    points are left to the checks that follow.
    """
    fan = np.stack([np.full(len(corners) - 2, corners[0]), corners[1:-1], corners[2:]], axis=1)
    if corners.min() < 0 or corners.max() >= len(points) or not np.isfinite(points[corners]).all():
        return fan
    rim = points[corners] - points[corners[0]]
    normals = np.cross(rim[1:-1], rim[2:])
    normal = normals.sum(axis=0)  # twice the area of any shape (Newell)
    if (normals @ normal >= 0).all() or not normal.any():
        return fan
    along = np.eye(3)[np.argmin(np.abs(normal))]
    x = np.cross(along, normal)
    x /= np.linalg.norm(x)
    y = np.cross(normal, x) / np.linalg.norm(normal)
    return corners[np.asarray(triangulate([np.column_stack([rim @ x, rim @ y])]), dtype=np.int64)]
