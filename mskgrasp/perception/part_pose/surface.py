"""Heights of a part's surface that an eye above the table sees."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from mskgrasp.core.geometry import quat_rotate
from mskgrasp.core.raster import raise_cells


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Triangles of a part.

    Attributes:
        vertices: (n, 3) in the part's frame or, of a part that lies, from the table, metres.
        faces: (m, 3) int32 vertices of every triangle.
    """

    vertices: np.ndarray
    faces: np.ndarray

    def rotated(self, quat_wxyz: np.ndarray, height: float) -> Surface:
        """The surface turned by a quaternion, then raised, metres."""
        vertices = quat_rotate(quat_wxyz, self.vertices)
        vertices[:, 2] += height
        return replace(self, vertices=vertices)

    def facing(self, steepest: float) -> Surface:
        """Only the faces whose normals' upward components are at least ``steepest``; they point outwards."""
        a, b, c = np.moveaxis(self.vertices[self.faces], 1, 0)
        normals = np.cross(b - a, c - a)
        up = normals[:, 2] >= steepest * np.linalg.norm(normals, axis=1)
        used, faces = np.unique(self.faces[up], return_inverse=True)
        return Surface(vertices=self.vertices[used], faces=faces.reshape(-1, 3).astype(np.int32))


@dataclass(frozen=True, kw_only=True)
class HeightMap:
    """Heights that an eye sees, over the plane at ``plane`` through which its rays pass.

    Attributes:
        heights: (h, w) metres over the table, 0 where the ray ends on the table; row along y, column along x.
        corner: (2,) x, y of the middle of cell (0, 0), metres.
        cell: Edge of a cell, metres.
        plane: Height of the plane, metres; an eye at infinity has none.
    """

    heights: np.ndarray
    corner: np.ndarray
    cell: float
    plane: float

    def bounds(self, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest height (h, w) within a square of ``reach`` around each cell."""
        size = 2 * round(reach / self.cell) + 1
        square = np.ones((size, size), np.uint8)
        return cv2.erode(self.heights, square), cv2.dilate(self.heights, square)

    def padded(self, border: float) -> HeightMap:
        """The map with an empty border of ``border``, metres, more on every side."""
        n = int(np.ceil(border / self.cell))
        return replace(self, heights=np.pad(self.heights, n), corner=self.corner - n * self.cell)


def heights_from(
    surface: Surface, eye: np.ndarray | None, *, plane: float, cell: float, margin: float
) -> HeightMap:
    """Compute the heights of a part that an eye sees in the middle of every cell.

    Args:
        surface: Of the part.
        eye: (3,) place of the eye in the same frame; None: straight above, infinitely far.
        plane: Height of the plane in which the map lies, metres.
        cell: Edge of a cell, metres.
        margin: Empty border around the part, metres.
    """
    x, y = on_plane(surface.vertices, eye, plane)
    z = surface.vertices[:, 2]
    low = np.array([x.min(), y.min()]) - margin
    width, height = (int(n) + 1 for n in (np.array([x.max(), y.max()]) + margin - low) / cell + 0.5)
    # Over the plane the inverse of the distance below the eye is linear on a triangle, the height is not.
    linear = z if eye is None else 1 / (eye[2] - z)
    table = 0.0 if eye is None else 1 / eye[2]
    highest = np.full((height, width), table)
    raise_cells(highest, (x - low[0]) / cell, (y - low[1]) / cell, linear, surface.faces)
    heights = highest if eye is None else eye[2] - 1 / highest
    return HeightMap(heights=heights.astype(np.float32), corner=low, cell=cell, plane=plane)


def on_plane(points: np.ndarray, eye: np.ndarray | None, plane: float) -> tuple[np.ndarray, np.ndarray]:
    """Compute x and y (n,) where the rays from an eye through points (n, 3) pass a height, metres."""
    x, y, z = points.T
    if eye is None:
        return x, y
    eye = np.asarray(eye, points.dtype)
    scale = (eye[2] - points.dtype.type(plane)) / (eye[2] - z)
    return eye[0] + (x - eye[0]) * scale, eye[1] + (y - eye[1]) * scale
