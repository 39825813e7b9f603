"""Likelihood of an image's heights, given the heights that a pose of the part would show."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from mskgrasp.core.geometry import Pose, quat_to_matrix
from mskgrasp.core.raster import raise_cells
from mskgrasp.perception.part_pose.surface import HeightMap, Surface, heights_from, on_plane

OUTLIERS = 0.01
"""Share of the pixels whose height may be anything."""
OUTLIER_RANGE = 0.1
"""Range of such heights, metres."""
FLYING = 0.4
"""Share of the pixels beside a high edge that float between its sides in a noisy image."""
FLYING_FROM = 0.007
"""Height from which an edge has such pixels, metres (Kinect v2: 10 mm, `hal.sensor_noise`)."""
FINER = 6
"""In an image without noise a pixel may see whatever lies within this fraction of a pixel: no pose that is
found is exact enough to say on which side of an edge its ray ends."""
_SMOOTHED = np.ones((5, 5), np.uint8)
"""Pixels between whose heights that of the one in their middle may lie in a smoothed image: the reach of the
filter and, before it, of pixels that float."""
_SQUARE = np.ones((3, 3), np.uint8)
_CROSS = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))


@dataclass(frozen=True, kw_only=True)
class Seen:
    """Pixels on and around a part; heights are above the table as measured around it.

    Attributes:
        points: (n, 3) x, y in base and height along the ray of every pixel, metres.
        heights: (n,) measured, metres.
        on_part: (n,) whether the pixel was detected as the part.
        window: (h, w) bool, where the pixels are in a part of the image.
        intrinsics: (3, 3) pinhole matrix of that part of the image, pixels.
        T_table_camera: Pose of the camera; axes of base, height from the table.
        sigma: Standard deviation of the heights, metres.
        noisy: Whether it is that of a noisy image.
        smoothed: Whether a filter of the camera has smoothed the noise, and the edges with it.
        pitch: Distance of neighbouring pixels, metres.
        centre: (2,) middle of the box around the part's pixels along x and y of base, metres.
        size: (2,) its edges, metres.
    """

    points: np.ndarray
    heights: np.ndarray
    on_part: np.ndarray
    window: np.ndarray
    intrinsics: np.ndarray
    T_table_camera: Pose
    sigma: float
    noisy: bool
    smoothed: bool
    pitch: float
    centre: np.ndarray
    size: np.ndarray

    @property
    def eye(self) -> np.ndarray:
        """Place (3,) of the camera, x, y in base and height, metres."""
        return np.asarray(self.T_table_camera.position)


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


class HeightLikelihood:
    """Likelihood of heights measured in places where a part has heights within bounds, with normal noise.

    In a noisy image a pixel near a high edge may float between its sides.

    Args:
        low: (n,) least height of every place, metres.
        high: (n,) greatest height.
        sigma: Standard deviation of heights, metres.
        edge: Least and greatest height (n,) each around every place, metres; None: no pixel floats.
    """

    def __init__(
        self,
        low: np.ndarray,
        high: np.ndarray,
        *,
        sigma: float,
        edge: tuple[np.ndarray, np.ndarray] | None,
    ):
        self._scale = np.float32(1 / (np.sqrt(2) * sigma))
        width = np.float32(sigma * np.sqrt(2 * np.pi))
        # At a cliff a height is one of both ends, between which the chances are even.
        usual = np.float32(1 - OUTLIERS) / (width + np.minimum(high - low, width))
        self._columns = [low, high, usual]
        if edge:
            least, most = edge
            share = np.where(most - least > FLYING_FROM, np.float32(FLYING), np.float32(0))
            self._columns[2] = usual * (1 - share)
            self._columns += [least, most, share / (most - least + width)]

    def costs(self, heights: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Negative logarithm of the likelihood of heights, metres, at places."""
        likely = self._bell(heights, places, 0)
        if len(self._columns) > 3:
            likely += self._bell(heights, places, 3)
        likely += np.float32(OUTLIERS / OUTLIER_RANGE)
        return np.negative(np.log(likely, out=likely), out=likely)

    def excess(self, heights: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """By how much the costs exceed those of the most likely heights at the same places, and its variance.

        What pixels that float near an edge cost on average is subtracted. Half of a squared normal number
        has a variance of a half; whether a pixel floats is one more source.
        """
        usual, least = self._columns[2][places], OUTLIERS / OUTLIER_RANGE
        costs, variance = self.costs(heights, places), np.full(len(places), 0.5)
        if len(self._columns) == 3:
            return costs + np.log(usual + least), variance
        floating = self._columns[5][places]
        share = np.where(floating > 0, FLYING, 0.0)
        best = np.log(usual + floating + least)
        price = best - np.log(floating + least)
        return costs + best - share * price, variance + share * (1 - share) * price**2

    def _bell(self, heights: np.ndarray, places: np.ndarray, first: int) -> np.ndarray:
        low, high, factor = self._columns[first : first + 3]
        off = low.take(places)
        off -= heights
        np.maximum(off, heights - high.take(places), out=off)
        np.maximum(off, 0, out=off)
        off *= self._scale
        np.square(off, out=off)
        np.negative(off, out=off)
        np.exp(off, out=off)
        off *= factor.take(places)
        return off


class HeightTable:
    """Likelihood of the heights of pixels at many poses, from the heights in a map.

    A pixel sees a height within the bounds of its cell's neighbours: the edges of a part are not sharper
    than the map.

    Args:
        seen_map: The map.
        sigma: Standard deviation of heights, metres.
        soft: Reach of a cell's neighbours, metres.
        flying: Reach of an edge, metres; 0: no pixel floats.
    """

    def __init__(self, seen_map: HeightMap, *, sigma: float, soft: float, flying: float):
        self._corner, self._cell, self._shape = seen_map.corner, seen_map.cell, seen_map.heights.shape
        low, high = _flat(seen_map.bounds(soft))
        edge = _flat(seen_map.bounds(max(flying, seen_map.cell))) if flying else None
        self._likelihood = HeightLikelihood(low, high, sigma=sigma, edge=edge)

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
        return self._likelihood.costs(pixels.heights, self.cells(pixels, poses))


class ExactHeights:
    """Heights that the pixels of an image see of a part at one pose, without a map between.

    Args:
        surface: Of the part in its resting pose.
        pose: (3,) x, y in base, metres, and turn.
        seen: The pixels.

    Attributes:
        heights: (n,) of the pixels, metres; 0 where the table is seen.
        near_low: (n,) least height of a pixel and its eight neighbours.
        near_high: (n,) greatest height of them.
    """

    def __init__(self, surface: Surface, pose: np.ndarray, seen: Seen):
        finer = 1 if seen.noisy else FINER
        fine = _image(surface, pose, seen, finer)
        image = np.ascontiguousarray(fine[::finer, ::finer])
        self._seen = seen
        self._pixels = np.arange(len(seen.heights))
        self.heights = image[seen.window]
        self.near_low, self.near_high = (bound[seen.window] for bound in _bounds(image, _SQUARE))
        if seen.smoothed:
            low, high, edge = self.near_low, self.near_high, None
        elif seen.noisy:
            low = high = self.heights
            least, most = _bounds(image, _CROSS)
            edge = least[seen.window], most[seen.window]
        else:
            low, high = (bound[::finer, ::finer][seen.window] for bound in _bounds(fine, _SQUARE))
            edge = None
        self._likelihood = self._tolerant = HeightLikelihood(low, high, sigma=seen.sigma, edge=edge)
        if seen.smoothed:
            low, high = (bound[seen.window] for bound in _bounds(image, _SMOOTHED))
            self._tolerant = HeightLikelihood(low, high, sigma=seen.sigma, edge=None)

    def costs(self) -> np.ndarray:
        """Negative logarithm (n,) of the likelihood of the heights measured."""
        return self._likelihood.costs(self._seen.heights.astype(np.float32), self._pixels)

    def excess(self) -> tuple[np.ndarray, np.ndarray]:
        """Excess of the costs (n,) and its variance (`HeightLikelihood.excess`).

        In a smoothed image heights may be those of pixels farther away than for the costs: with these bounds
        for both, edges would hardly tell where the part is.
        """
        return self._tolerant.excess(self._seen.heights.astype(np.float32), self._pixels)


def _image(surface: Surface, pose: np.ndarray, seen: Seen, finer: int) -> np.ndarray:
    """Heights (h, w) of the window's pixels and, so many times finer, between them; float32, metres."""
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    x, y, z = surface.vertices.T
    placed = np.stack([cos * x - sin * y + pose[0], sin * x + cos * y + pose[1], z], axis=-1)
    x, y, depth = seen.T_table_camera.inverse().apply(placed).T
    (fx, _, cx), (_, fy, cy), _ = seen.intrinsics * finer
    rows, columns = (np.arange((n - 1) * finer + 1) for n in seen.window.shape)
    rays = np.stack(np.broadcast_arrays((columns - cx) / fx, ((rows - cy) / fy)[:, None], 1.0), axis=-1)
    falls = -(rays @ quat_to_matrix(seen.T_table_camera.quat_wxyz)[2])
    # The inverse of the depth is linear on a triangle. Nothing lies under the table, on which all rays end.
    inverse = falls / seen.eye[2]
    raise_cells(inverse, fx * x / depth + cx, fy * y / depth + cy, 1 / depth, surface.faces)
    return (seen.eye[2] - falls / inverse).astype(np.float32)


def _bounds(image: np.ndarray, neighbours: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest height (h, w) of each pixel and its neighbours."""
    return cv2.erode(image, neighbours), cv2.dilate(image, neighbours)


def _flat(arrays: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    return arrays[0].reshape(-1), arrays[1].reshape(-1)


def view(
    surface: Surface, pose: np.ndarray, eye: np.ndarray, *, plane: float, cell: float, reach: float
) -> HeightMap:
    """Compute the heights of a part at a pose (3,), in the part's frame, as an eye (3,) in base sees them.

    The bounds of heights within ``reach``, metres, are those of the table at the map's border, to which what
    lies outside is clipped.
    """
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    x, y = eye[:2] - pose[:2]
    own = np.array([cos * x + sin * y, cos * y - sin * x, eye[2]])
    return heights_from(surface, own, plane=plane, cell=cell, margin=reach + 2 * cell)
