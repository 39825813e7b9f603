"""Surface of a part as points, and the heights of it that an eye above the table sees."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

DEEP, MOST_MISSED = 1e-3, 3
"""Gaps of one or two cells' width that are deeper, metres, and longer, cells, are slits, which may be seen to
their bottom."""


def sample_surface(triangles: np.ndarray, spacing: float) -> np.ndarray:
    """Sample triangles (n, 3, 3) in rows along their longest edges; neighbours are at most ``spacing`` apart.

    Returns:
        (k, 3) points, those of neighbouring triangles merged.
    """
    sides = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=-1)
    first = np.argmax(sides, axis=1)
    order = (first[:, None] + np.arange(3)) % 3
    a, b, c = np.moveaxis(np.take_along_axis(triangles, order[..., None], axis=1), 1, 0)
    length = sides[np.arange(len(sides)), first]
    area = np.linalg.norm(np.cross(b - a, c - a), axis=-1) / 2
    height = 2 * area / np.maximum(length, 1e-12)
    which, share = _fractions(np.ceil(height / spacing).astype(int) + 1)
    starts = a[which] + share[:, None] * (c - a)[which]
    ends = b[which] + share[:, None] * (c - b)[which]
    row, along = _fractions(np.ceil(length[which] * (1 - share) / spacing).astype(int) + 1)
    points = starts[row] + along[:, None] * (ends - starts)[row]
    cell = np.round(points / (0.6 * spacing)).astype(np.int64)
    _, kept = np.unique(cell @ np.array([1, 1 << 20, 1 << 40]), return_index=True)
    return points[kept]


def ascending(points: np.ndarray) -> np.ndarray:
    """Sort points (n, 3) by height, the lowest first; stored by coordinate, so that each is contiguous."""
    return np.ascontiguousarray(points[np.argsort(points[:, 2], kind="stable")].T).T


def _fractions(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Number ``counts[i]`` items of every i from 0 to 1: i, and the fraction, of every item."""
    which = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    return which, number / np.maximum(counts[which] - 1, 1)


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
        size = 2 * max(1, round(reach / self.cell)) + 1
        square = np.ones((size, size), np.uint8)
        return cv2.erode(self.heights, square), cv2.dilate(self.heights, square)

    def padded(self, border: float) -> HeightMap:
        """The map with an empty border of ``border``, metres, more on every side."""
        n = int(np.ceil(border / self.cell))
        return replace(self, heights=np.pad(self.heights, n), corner=self.corner - n * self.cell)


def heights_from(
    points: np.ndarray, eye: np.ndarray | None, *, plane: float, cell: float, margin: float
) -> HeightMap:
    """Compute the heights of a part that an eye sees.

    Args:
        points: (n, 3) float32 on its surface, z from the table, metres, `ascending`.
        eye: (3,) place of the eye in the same frame; None: straight above, infinitely far.
        plane: Height of the plane in which the map lies, metres.
        cell: Edge of a cell, metres, not less than the distance of neighbouring points.
        margin: Empty border around the part, metres.
    """
    x, y = on_plane(points, eye, plane)
    low = np.array([x.min(), y.min()]) - margin
    width, height = (int(n) + 1 for n in (np.array([x.max(), y.max()]) + margin - low) / cell + 0.5)
    scale, first = np.float32(1 / cell), (low / cell).astype(np.float32)
    column = (x * scale - (first[0] - np.float32(0.5))).astype(np.int32)
    row = (y * scale - (first[1] - np.float32(0.5))).astype(np.int32)
    heights = np.zeros(width * height, np.float32)
    # Assignments are made in the order of the points, so that of several in a cell the highest stays. With
    # maximum.at, which is slow where neighbouring points lie in one cell, a search took twice as long.
    heights[row * width + column] = np.maximum(points[:, 2], 0)
    return HeightMap(
        heights=_without_holes(heights.reshape(height, width)), corner=low, cell=cell, plane=plane
    )


def _without_holes(heights: np.ndarray) -> np.ndarray:
    """Raise cells that were missed: between points that are nearly a cell apart one or two may be.

    Many of them in a row are a slit.
    """
    closed = cv2.morphologyEx(heights, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    deep = (closed - heights > DEEP).astype(np.uint8)
    if np.count_nonzero(deep) > MOST_MISSED:
        _, labels, stats, _ = cv2.connectedComponentsWithStats(deep, connectivity=8)
        slit = stats[:, cv2.CC_STAT_AREA] > MOST_MISSED
        slit[0] = False  # all other cells
        closed[slit[labels.astype(np.intp)]] = 0.0
    return closed


def on_plane(points: np.ndarray, eye: np.ndarray | None, plane: float) -> tuple[np.ndarray, np.ndarray]:
    """Compute x and y (n,) where the rays from an eye through points (n, 3) pass a height, metres."""
    x, y, z = points.T
    if eye is None:
        return x, y
    eye = np.asarray(eye, points.dtype)
    scale = (eye[2] - points.dtype.type(plane)) / (eye[2] - z)
    return eye[0] + (x - eye[0]) * scale, eye[1] + (y - eye[1]) * scale
