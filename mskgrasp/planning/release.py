"""Opening at which the fingers release a placed part without pushing it or taking it along.

A finger may hold a part beneath an overhang, such as the gusset of a bracket or the head of a screw. Opened a
little it is still there, and lifts the part as it rises; opened wide in a bore it pushes the other side.
"""

from __future__ import annotations

import numpy as np

from hal.camera import RgbdFrame
from hal.execute import LEAST_RELEASE, RELEASE
from mskgrasp.core.grasp import (
    FINGER_HALF_WIDTH,
    FINGER_THICKNESS,
    MAX_OPENING,
    PAD_REACH,
    Grasp,
)
from mskgrasp.perception.footprint import pixel_pitch, seen_points
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.planning.refine import where_held

_STEP = 0.001
"""Distance of the openings that are looked at, metres."""
_PAD_TOP, _PAD_THICKNESS = 0.009, 0.015
"""Upper face of a pad's collision box over the TCP, and distance from its face to its back, metres."""
_EDGE = 0.003
"""What is seen so near to a pad's face may be the edge of the held part itself, metres."""
_NOISE = 0.003
"""Heights that exceed the tips by less are noise, metres."""


def release_opening(frame: RgbdFrame, plan: GraspPlan, width: float) -> float | None:
    """Compute the opening of the fingers that frees the part, by its heights as seen where it lay.

    Args:
        frame: The frame that the grasp was planned on.
        plan: The grasp.
        width: Distance of the pads that hold the part, metres.

    Returns:
        Metres: `hal.execute.RELEASE` more than ``width``, less where that would push the part, or more where
        a finger is beneath an overhang: the least opening that is clear of it, or the hand's. None, as
        `hal.let_go` takes it, where the planner predicts no displacement: what is beside the fingers is not
        known then.
    """
    if not np.nan_to_num(plan.grasp_displacement).any():
        return None
    points = _points_beside(frame, plan)
    least, usual = width + LEAST_RELEASE, min(width + RELEASE, MAX_OPENING)
    if _highest(points, width / 2 + _EDGE, width / 2 + _PAD_THICKNESS) > _PAD_TOP:
        margin = pixel_pitch(frame)
        for opening in (*np.arange(usual, MAX_OPENING, _STEP), *np.arange(usual, least, -_STEP)):
            if _clear(points, opening / 2 - margin, opening):
                return float(opening)
        return MAX_OPENING
    openings = np.arange(least, usual, _STEP)
    blocked = [not _clear(points, opening / 2 + _EDGE, opening) for opening in openings]
    if not any(blocked):
        return usual
    return float(openings[max(0, blocked.index(True) - 1)])


def _points_beside(frame: RgbdFrame, plan: GraspPlan) -> np.ndarray:
    """(n, 2) of the part as seen: distance from the middle between the pads, height over the TCP, metres."""
    held = where_held(plan.grasp.as_vector()[None], np.nan_to_num(plan.grasp_displacement)[None])[0]
    points, view = seen_points(frame) - [0.0, 0.0, plan.view.table_offset], plan.view
    within = np.abs(view.T_base_box.inverse().apply(points)[:, :2])
    points = points[(within <= np.asarray(view.size)[:2] / 2 + pixel_pitch(frame)).all(axis=1)]
    points = Grasp.from_vector(held).T_base_grasp.inverse().apply(points)
    points = points[np.abs(points[:, 0]) <= FINGER_HALF_WIDTH]
    return np.column_stack([np.abs(points[:, 1]), points[:, 2]])


def _clear(points: np.ndarray, begin: float, opening: float) -> bool:
    """Whether nothing rises above the tips of open fingers, from ``begin`` to their backs."""
    return _highest(points, begin, opening / 2 + FINGER_THICKNESS) <= _NOISE - PAD_REACH


def _highest(points: np.ndarray, begin: float, end: float) -> float:
    """Height of the third highest point between two distances: two pixels may be wrong."""
    heights = points[(points[:, 0] >= begin) & (points[:, 0] <= end), 1]
    return float(np.sort(heights)[-3]) if len(heights) >= 3 else -np.inf
