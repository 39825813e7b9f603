"""Clearance between the open hand and a part: motions in free air need no simulation.

A descent beside the part and the first stretch of closing fingers have no effect where they meet nothing, so
that they need not be simulated. Both follow from the part's hulls, exactly in the plane and
conservatively in height.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mskgrasp.core.grasp import FINGER_HALF_WIDTH, FINGER_THICKNESS, MAX_OPENING, PAD_REACH, PALM_HEIGHT

MARGIN = 0.002
"""Between hand and part, m; the arm is placed at a pose to a hundredth of that."""


@dataclass(frozen=True)
class Clearance:
    """Clearance of an open hand.

    Attributes:
        free: The open hand can be placed at the grasp without a descent.
        reach: Greatest distance of the part between the pads from the middle, m; 0 without a part there.
            Valid only if ``free``.
    """

    free: bool
    reach: float


def hand_clearance(hulls: Sequence[np.ndarray]) -> Clearance:
    """Clearance of the open hand at a grasp.

    Args:
        hulls: Corners (k, 3) of each of the part's hulls in the grasp frame, metres.
    """
    inner, outer = MAX_OPENING / 2 - MARGIN, MAX_OPENING / 2 + FINGER_THICKNESS + MARGIN
    reach = 0.0
    for corners in hulls:
        top = corners[:, 2].max()
        if top > PALM_HEIGHT - MARGIN:
            return Clearance(free=False, reach=0.0)
        if top < -PAD_REACH - MARGIN:
            continue
        span = _across(corners[:, :2], FINGER_HALF_WIDTH + MARGIN)
        if span is None:
            continue
        low, high = span
        if (high > inner and low < outer) or (low < -inner and high > -outer):
            return Clearance(free=False, reach=0.0)
        if low < inner and high > -inner:
            reach = max(reach, high, -low)
    return Clearance(free=True, reach=reach)


def _across(corners: np.ndarray, half_width: float) -> tuple[float, float] | None:
    """Span of y of the hull of points (k, 2) within |x| <= half_width; None where it has no part there."""
    x, y = corners.T
    within = np.abs(x) <= half_width
    found = [y[within]]
    for edge in (-half_width, half_width):
        left, right = x < edge, x > edge
        if left.any() and right.any():
            # The hull's outline crosses the edge of the band on a line between two of its corners.
            run = x[right][None] - x[left][:, None]
            rise = y[right][None] - y[left][:, None]
            found.append((y[left][:, None] + rise * (edge - x[left][:, None]) / run).ravel())
    spans = np.concatenate(found)
    return (float(spans.min()), float(spans.max())) if len(spans) else None
