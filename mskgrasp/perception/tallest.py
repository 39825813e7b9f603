"""Height of the tallest thing in a depth image, which the hand passes over."""

from __future__ import annotations

import cv2
import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.core.grasp import PartView
from mskgrasp.perception.footprint import seen_points

BESIDE = 0.01
"""Distance from a part's box from which points are of other things, metres."""
_SOLID = 2
"""Fewer pixels side by side, along rows or columns, are specks of noise."""


def tallest_thing(
    frame: RgbdFrame,
    *,
    table_z: float,
    lower: np.ndarray,
    upper: np.ndarray,
    beside: PartView | None = None,
) -> float:
    """Height over the table of the highest point seen, metres; 0 for an empty table.

    Args:
        frame: Captured with the arm at home.
        table_z: Height of the table, base frame, metres.
        lower: (3,) or (2,) corner of the space where the hand moves, base frame, metres; what is seen beside
            it, such as a person, does not count.
        upper: The other corner.
        beside: A part that does not count; None: all do.
    """
    points = seen_points(frame)
    x, y = points[:, 0], points[:, 1]
    with np.errstate(invalid="ignore"):
        counts = (x >= lower[0]) & (x <= upper[0]) & (y >= lower[1]) & (y <= upper[1])
        if beside is not None:
            own = beside.T_base_box.inverse().apply(points)[:, :2]
            counts &= (np.abs(own) > beside.size[:2] / 2 + BESIDE).any(axis=1)
    heights = np.where(counts & np.isfinite(points[:, 2]), points[:, 2] - table_z, 0.0)
    image = heights.reshape(frame.depth.shape).astype(np.float32)
    solid = cv2.erode(image, np.ones((_SOLID, _SOLID), np.uint8))
    return max(0.0, float(solid.max()))
