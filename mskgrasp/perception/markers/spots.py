"""White spots in a grey image, located and measured with subpixel accuracy."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

_ZOOM = 8
_MANY = 8


@dataclass(frozen=True, kw_only=True)
class Spot:
    """A connected group of pixels brighter than a level.

    Attributes:
        centre: (2,) column and row of its centroid, pixels; the centre of a pixel has integer coordinates.
        sides: (2,) the longer and the shorter one of the rectangle with its second moments, pixels.
        side: Side of the square with its area, pixels.
        fill: Share of its smallest rectangle that it fills: 1 for a square, 0.79 for a disc; 0 if it is too
            large to be measured.
        inside: (k, 2) columns and rows of its pixels; none if it is too large.
    """

    centre: np.ndarray
    sides: np.ndarray
    side: float
    fill: float
    inside: np.ndarray


def find_spots(grey: np.ndarray, level: int, *, least: float, most: float) -> list[Spot]:
    """Find the largest white spots, largest first, eight at most.

    Args:
        grey: (h, w) uint8.
        level: Brighter pixels are white.
        least: Area of the smallest spot that counts, pixels.
        most: A spot longer than this is described by its bounding box alone, pixels.
    """
    _, labels, stats, _ = cv2.connectedComponentsWithStats((grey > level).astype(np.uint8), connectivity=8)
    numbers = 1 + np.flatnonzero(stats[1:, cv2.CC_STAT_AREA] >= least)
    largest = numbers[np.argsort(-stats[numbers, cv2.CC_STAT_AREA], kind="stable")][:_MANY]
    return [
        _measured(grey, labels, int(number), stats[number, :4], level)
        if max(stats[number, 2:4]) <= most
        else _large(stats[number, :4])
        for number in largest
    ]


def _large(box: np.ndarray) -> Spot:
    sides = np.sort(box[2:].astype(np.float64))[::-1]
    return Spot(
        centre=box[:2] + (box[2:] - 1) / 2,
        sides=sides,
        side=float(np.sqrt(sides.prod())),
        fill=0.0,
        inside=np.empty((0, 2)),
    )


def _measured(grey: np.ndarray, labels: np.ndarray, number: int, box: np.ndarray, level: int) -> Spot:
    """Measure the area within the interpolated contour of the grey level."""
    left, top = np.maximum(box[:2] - 2, 0)
    window = np.s_[top : box[1] + box[3] + 2, left : box[0] + box[2] + 2]
    own = labels[window] == number
    # A neighbouring spot is cut down to the level, so that it adds nothing.
    values = np.where(own, grey[window], np.minimum(grey[window], level)).astype(np.float32)
    larger = cv2.resize(values, None, fx=_ZOOM, fy=_ZOOM, interpolation=cv2.INTER_LINEAR)
    mask = (larger > level).astype(np.uint8)
    moments = cv2.moments(mask, binaryImage=True)
    if moments["m00"] == 0:  # a line so thin and so little over the level that nothing of it is left
        return _large(box)
    centre = np.array([moments["m10"], moments["m01"]]) / moments["m00"]
    second_moments = np.array([[moments["mu20"], moments["mu11"]], [moments["mu11"], moments["mu02"]]])
    # A rectangle's side is the square root of twelve times the variance along it.
    sides = np.sqrt(12 * np.maximum(np.linalg.eigvalsh(second_moments)[::-1], 0.0) / moments["m00"])
    width, height = cv2.minAreaRect(np.argwhere(mask)[:, ::-1].astype(np.int32))[1]
    rows, columns = np.nonzero(own)
    return Spot(
        centre=(centre + 0.5) / _ZOOM - 0.5 + (left, top),
        sides=sides / _ZOOM,
        side=float(np.sqrt(moments["m00"])) / _ZOOM,
        fill=moments["m00"] / ((width + 1) * (height + 1)),  # from centre to centre of the outermost pixels
        inside=np.column_stack([columns, rows]) + (left, top),
    )
