"""Likelihood of an image's heights, given the heights that a pose of the part would show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mskgrasp.perception.part_pose.surface import HeightMap, heights_from, on_plane

OUTLIERS = 0.01
"""Share of the pixels whose height may be anything."""
OUTLIER_RANGE = 0.1
"""Range of such heights, metres."""
FLYING = 0.4
"""Share of the pixels beside a high edge that float between its sides in a noisy image."""
FLYING_FROM = 0.007
"""Height from which an edge has such pixels, metres (Kinect v2: 10 mm, `hal.sensor_noise`)."""


@dataclass(frozen=True, kw_only=True)
class Seen:
    """Pixels on and around a part; heights are above the table as measured around it.

    Attributes:
        points: (n, 3) x, y in base and height along the ray of every pixel, metres.
        heights: (n,) measured, metres.
        on_part: (n,) whether the pixel was detected as the part.
        window: (h, w) bool, where the pixels are in the image.
        eye: (3,) place of the camera, x, y in base and height, metres.
        sigma: Standard deviation of the heights, metres.
        noisy: Whether it is that of a noisy image.
        pitch: Distance of neighbouring pixels, metres.
        centre: (2,) middle of the box around the part's pixels along x and y of base, metres.
        size: (2,) its edges, metres.
    """

    points: np.ndarray
    heights: np.ndarray
    on_part: np.ndarray
    window: np.ndarray
    eye: np.ndarray
    sigma: float
    noisy: bool
    pitch: float
    centre: np.ndarray
    size: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Pixels:
    """Pixels by where their rays pass a plane: (n,) float32 x, y from ``origin``, and heights, metres."""

    x: np.ndarray
    y: np.ndarray
    heights: np.ndarray
    origin: np.ndarray

    @classmethod
    def of(cls, seen: Seen, plane: float | None, origin: np.ndarray) -> Pixels:
        """Pixels in a plane; None: where they are seen, as from straight above."""
        x, y = on_plane(seen.points, None if plane is None else seen.eye, plane or 0.0)
        return cls(
            x=(x - origin[0]).astype(np.float32),
            y=(y - origin[1]).astype(np.float32),
            heights=seen.heights.astype(np.float32),
            origin=origin,
        )

    def take(self, which: np.ndarray) -> Pixels:
        """Some of the pixels."""
        return Pixels(x=self.x[which], y=self.y[which], heights=self.heights[which], origin=self.origin)


class HeightTable:
    """Likelihood of heights at the cells of a map.

    A pixel sees a height within the bounds of its cell's neighbours, with normal noise: the edges of a part
    are not sharper than the map. In a noisy image a pixel near a high edge may float between its sides.

    Args:
        seen_map: The map.
        sigma: Standard deviation of heights, metres.
        soft: Reach of a cell's neighbours, metres.
        flying: Reach of an edge, metres; 0: no pixel floats.
    """

    def __init__(self, seen_map: HeightMap, *, sigma: float, soft: float, flying: float):
        self._corner, self._cell, self._shape = seen_map.corner, seen_map.cell, seen_map.heights.shape
        self._scale = np.float32(1 / (np.sqrt(2) * sigma))
        width = np.float32(sigma * np.sqrt(2 * np.pi))
        low, high = seen_map.bounds(soft)
        # At a cliff a height is one of both ends, between which the chances are even.
        usual = np.float32(1 - OUTLIERS) / (width + np.minimum(high - low, width))
        columns = [low, high, usual]
        if flying:
            least, most = seen_map.bounds(flying)
            share = np.where(most - least > FLYING_FROM, np.float32(FLYING), np.float32(0))
            columns[2] *= 1 - share
            columns += [least, most, share / (most - least + width)]
        self._columns = [column.reshape(-1) for column in columns]

    def cells(self, pixels: Pixels, poses: np.ndarray) -> np.ndarray:
        """Index (m, n) of the cell that every pixel sees of the part at poses (m, 3)."""
        cos, sin = np.cos(poses[:, 2]) / self._cell, np.sin(poses[:, 2]) / self._cell
        x, y = (poses[:, :2] - pixels.origin).T
        # Half a cell is added, because numbers are rounded towards zero.
        first = 0.5 - self._corner / self._cell
        column = self._along(pixels, cos, sin, first[0] - cos * x - sin * y, self._shape[1])
        row = self._along(pixels, -sin, cos, first[1] + sin * x - cos * y, self._shape[0])
        row *= self._shape[1]
        row += column
        return row

    @staticmethod
    def _along(pixels: Pixels, x: np.ndarray, y: np.ndarray, first: np.ndarray, n: int) -> np.ndarray:
        place = np.multiply.outer(x.astype(np.float32), pixels.x)
        place += np.multiply.outer(y.astype(np.float32), pixels.y)
        place += first.astype(np.float32)[:, None]
        return np.clip(place, 0, n - 1, out=place).astype(np.int32)

    def costs(self, pixels: Pixels, poses: np.ndarray) -> np.ndarray:
        """Negative logarithm (m, n) of the likelihood of every pixel at poses (m, 3): x, y in base, turn."""
        cells = self.cells(pixels, poses)
        likely = self._bell(pixels.heights, cells, 0)
        if len(self._columns) > 3:
            likely += self._bell(pixels.heights, cells, 3)
        likely += np.float32(OUTLIERS / OUTLIER_RANGE)
        return np.negative(np.log(likely, out=likely), out=likely)

    def excess(self, pixels: Pixels, pose: np.ndarray) -> np.ndarray:
        """By how much the costs (n,) at a pose exceed those of the most likely heights at the same cells.

        What pixels that float near an edge cost on average is subtracted.
        """
        cells = self.cells(pixels, pose[None])[0]
        usual, least = self._columns[2][cells], OUTLIERS / OUTLIER_RANGE
        costs = self.costs(pixels, pose[None])[0]
        if len(self._columns) == 3:
            return costs + np.log(usual + least)
        floating = self._columns[5][cells]
        share = np.where(floating > 0, FLYING, 0.0)
        best = np.log(usual + floating + least)
        return costs + best - share * (best - np.log(floating + least))

    def _bell(self, heights: np.ndarray, cells: np.ndarray, first: int) -> np.ndarray:
        low, high, factor = self._columns[first : first + 3]
        off = low.take(cells)
        off -= heights
        np.maximum(off, heights - high.take(cells), out=off)
        np.maximum(off, 0, out=off)
        off *= self._scale
        np.square(off, out=off)
        np.negative(off, out=off)
        np.exp(off, out=off)
        off *= factor.take(cells)
        return off


def view(
    points: np.ndarray, pose: np.ndarray, eye: np.ndarray, *, plane: float, cell: float, reach: float
) -> HeightMap:
    """Compute the heights of a part at a pose (3,), in the part's frame, as an eye (3,) in base sees them.

    The points (n, 3) are `ascending`.

    The bounds of heights within ``reach``, metres, are those of the table at the map's border, to which what
    lies outside is clipped.
    """
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    x, y = eye[:2] - pose[:2]
    own = np.array([cos * x + sin * y, cos * y - sin * x, eye[2]])
    return heights_from(points, own, plane=plane, cell=cell, margin=reach + 2 * cell)
