"""Likelihood of an image's heights, given the heights that a pose of the part would show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

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

    x: torch.Tensor
    y: torch.Tensor
    heights: torch.Tensor
    origin: np.ndarray

    @classmethod
    def of(cls, seen: Seen, plane: float | None, origin: np.ndarray) -> Pixels:
        """Pixels in a plane; None: where they are seen, as from straight above."""
        x, y = on_plane(seen.points, None if plane is None else seen.eye, plane or 0.0)
        x, y = (torch.from_numpy((v - o).astype(np.float32)) for v, o in zip((x, y), origin, strict=True))
        return cls(x=x, y=y, heights=torch.from_numpy(seen.heights.astype(np.float32)), origin=origin)

    def take(self, which: np.ndarray) -> Pixels:
        """Some of the pixels."""
        index = torch.from_numpy(which)
        return Pixels(x=self.x[index], y=self.y[index], heights=self.heights[index], origin=self.origin)


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
        self._scale = 1 / (np.sqrt(2) * sigma)
        width = np.float32(sigma * np.sqrt(2 * np.pi))
        low, high = seen_map.bounds(soft)
        # At a cliff a height is one of both ends, between which the chances are even.
        columns = [low, high, (1 - OUTLIERS) / (width + np.minimum(high - low, width))]
        if flying:
            least, most = seen_map.bounds(flying)
            share = np.where(most - least > FLYING_FROM, np.float32(FLYING), np.float32(0))
            columns[2] *= 1 - share
            columns += [least, most, share / (most - least + width)]
        self._table = torch.from_numpy(np.stack(columns, axis=-1).reshape(-1, len(columns)))

    def cells(self, pixels: Pixels, poses: np.ndarray) -> torch.Tensor:
        """Index (m, n) of the cell that every pixel sees of the part at poses (m, 3)."""
        cos, sin = np.cos(poses[:, 2]) / self._cell, np.sin(poses[:, 2]) / self._cell
        x, y = (poses[:, :2] - pixels.origin).T
        # Half a cell is added, because numbers are rounded towards zero.
        first = 0.5 - self._corner / self._cell
        to_column = np.stack([cos, sin, first[0] - cos * x - sin * y], axis=-1).astype(np.float32)
        to_row = np.stack([-sin, cos, first[1] + sin * x - cos * y], axis=-1).astype(np.float32)
        points = torch.stack([pixels.x, pixels.y, torch.ones_like(pixels.x)])
        column = (torch.from_numpy(to_column) @ points).clamp_(0, self._shape[1] - 1).to(torch.int32)
        row = (torch.from_numpy(to_row) @ points).clamp_(0, self._shape[0] - 1).to(torch.int32)
        return row.mul_(self._shape[1]).add_(column)

    def costs(self, pixels: Pixels, poses: np.ndarray) -> torch.Tensor:
        """Negative logarithm (m, n) of the likelihood of every pixel at poses (m, 3): x, y in base, turn."""
        cells = self.cells(pixels, poses)
        found = self._table.index_select(0, cells.view(-1)).view(*cells.shape, -1)
        likely = self._bell(pixels.heights, found[..., 0], found[..., 1]).mul_(found[..., 2])
        if found.shape[-1] > 3:
            likely += self._bell(pixels.heights, found[..., 3], found[..., 4]).mul_(found[..., 5])
        return likely.add_(OUTLIERS / OUTLIER_RANGE).log_().neg_()

    def excess(self, pixels: Pixels, poses: np.ndarray) -> torch.Tensor:
        """By how much the costs (m, n) exceed those of the most likely height at the same cell.

        What pixels that float near an edge cost on average is subtracted.
        """
        found = self._table[self.cells(pixels, poses).long()]
        usual, least = found[..., 2], OUTLIERS / OUTLIER_RANGE
        if found.shape[-1] == 3:
            return self.costs(pixels, poses) + (usual + least).log()
        floating = found[..., 5]
        share = torch.where(floating > 0, FLYING, 0.0)
        expected = share * ((usual + floating + least) / (floating + least)).log()
        return self.costs(pixels, poses) + (usual + floating + least).log() - expected

    def _bell(self, heights: torch.Tensor, low: torch.Tensor, high: torch.Tensor) -> torch.Tensor:
        off = torch.maximum(low - heights, heights - high).clamp_(min=0).mul_(self._scale)
        return off.square_().neg_().exp_()


def view(points: np.ndarray, pose: np.ndarray, eye: np.ndarray, *, plane: float, cell: float) -> HeightMap:
    """Compute the heights of a part at a pose (3,), in the part's frame, as an eye (3,) in base sees them."""
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    x, y = eye[:2] - pose[:2]
    own = np.array([cos * x + sin * y, cos * y - sin * x, eye[2]])
    return heights_from(points, own, plane=plane, cell=cell, margin=4 * cell)
