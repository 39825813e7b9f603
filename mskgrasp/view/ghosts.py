"""Poses in which a part is expected in the hand once the fingers have closed, and their spread."""

from __future__ import annotations

import numpy as np

from mskgrasp.core.geometry import Pose, quat_about_z
from mskgrasp.core.grasp import to_grasp_displacement
from mskgrasp.planning.grasp_plan import GraspPlan


def motion_of(
    T_base_grasp: Pose, displacement: np.ndarray, point_base: np.ndarray, swing: np.ndarray | None = None
) -> Pose:
    """The motion of a part relative to the hand at its grasp, in the base frame.

    Args:
        T_base_grasp: The grasp.
        displacement: (4,) displacement of the point in the hand, axes of the grasp frame, metres and radians.
        point_base: (3,) the point of the part before the grasp, base frame.
        swing: (2,) swing of the part about x and y of the grasp frame, radians; None or NaN: none.

    Returns:
        The pose M: what of the part was at p before is then at ``M.apply(p)``.
    """
    point = T_base_grasp.inverse().apply(np.asarray(point_base, dtype=np.float64))
    hand = np.asarray(to_grasp_displacement(np.asarray(displacement, dtype=np.float64), point))
    # The hand moves by it in the part's frame: the part moves by the inverse.
    motion = Pose(position=hand[:3], quat_wxyz=quat_about_z(hand[3])).inverse()
    if swing is not None and np.isfinite(swing).all() and np.any(swing):
        at = point + displacement[:3]
        angle = float(np.linalg.norm(swing))
        axis = np.array([*swing, 0.0]) / angle
        turn = np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * axis])
        about = Pose(position=np.zeros(3), quat_wxyz=turn)
        motion = Pose(position=at - about.apply(at), quat_wxyz=turn) @ motion
    return T_base_grasp @ motion @ T_base_grasp.inverse()


def expected_motion(plan: GraspPlan) -> Pose:
    """The motion, as `motion_of`, that a plan predicts."""
    return motion_of(plan.grasp.T_base_grasp, plan.displacement, plan.view.centre_base, plan.swing)


def likely_motions(plan: GraspPlan) -> list[Pose]:
    """The motions at two standard deviations along each axis of a plan's spread, both ways.

    The turn counts by the way of the part's points at its radius of gyration, so that all four axes are
    lengths. Without a predicted variance there are none.

    Returns:
        Eight motions as `motion_of`.
    """
    if not np.isfinite(plan.displacement_cov).all():
        return []
    lengths = np.array([1.0, 1.0, 1.0, plan.view.gyration_radius])
    variances, axes = np.linalg.eigh(plan.displacement_cov * lengths * lengths[:, None])
    steps = 2.0 * np.sqrt(np.maximum(variances, 0.0)) * axes / lengths[:, None]
    return [
        motion_of(plan.grasp.T_base_grasp, plan.displacement + sign * step, plan.view.centre_base, plan.swing)
        for step in steps.T
        for sign in (-1.0, 1.0)
    ]
