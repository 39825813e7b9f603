"""Paths of the arm: joint angles over time, minimum jerk."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from hal.errors import OutOfWorkspace
from mskgrasp.core.geometry import Pose, pose_distance, straight_line
from mskgrasp.core.minimum_jerk import minimum_jerk, minimum_jerk_duration
from mskgrasp.core.panda_kinematics import POSE_TOLERANCE, forward_pose, track, within_limits

PERIOD_S = 0.05
"""Time between two knots of a path, s: the curve between them is off by less than 0.01 mm at 0.5 m/s."""


@dataclass(frozen=True, kw_only=True)
class JointPath:
    """Knots of a motion, evenly spaced in time; the first is the current position.

    Attributes:
        seconds: (k,) since the start.
        joints: (k, 7) radians.
    """

    seconds: np.ndarray
    joints: np.ndarray

    @property
    def duration_s(self) -> float:
        """Seconds from the first knot to the last."""
        return float(self.seconds[-1])

    def curve(self) -> BSpline:
        """Joints (7,) over seconds: without steps of acceleration, and without any at both ends."""
        at_rest = [(1, np.zeros(7)), (2, np.zeros(7))]
        return make_interp_spline(self.seconds, self.joints, k=5, bc_type=(at_rest, at_rest))


@dataclass(frozen=True, kw_only=True)
class Peaks:
    """Greatest rates of a minimum-jerk motion.

    Attributes:
        speed: (...) m/s or rad/s.
        acceleration: (...) m/s^2 or rad/s^2.
        jerk: (...) m/s^3 or rad/s^3.
    """

    speed: np.ndarray
    acceleration: np.ndarray
    jerk: np.ndarray

    @classmethod
    def of(cls, distance: np.ndarray, seconds: float) -> Peaks:
        """Peaks over distances (...) in m or rad, all in the same time (derivatives of `minimum_jerk`)."""
        return cls(
            speed=15 / 8 * distance / seconds,
            acceleration=10 / math.sqrt(3) * distance / seconds**2,
            jerk=60 * distance / seconds**3,
        )


def joint_path(
    start: np.ndarray, goal: np.ndarray, *, speed: np.ndarray, acceleration: np.ndarray
) -> JointPath:
    """All joints from (7,) to (7,) radians together, under speeds (7,) rad/s and accelerations (7,)."""
    way = goal - start
    seconds = max(_duration(abs(way[i]), speed[i], acceleration[i]) for i in range(7))
    share = _profile(seconds)
    times = np.linspace(0, seconds, len(share))
    return JointPath(seconds=times, joints=start + share[:, None] * way)


def straight_path(
    start: np.ndarray,
    goal: Pose,
    *,
    speed: float,
    turn_speed: float,
    acceleration: float,
    turn_acceleration: float,
    joint_speed: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
) -> JointPath:
    """The TCP on the straight line from where joints (7,) put it to ``goal``, turning at the same pace.

    Args:
        start: (7,) radians.
        goal: ``T_base_tcp`` at the end.
        speed: Greatest speed of the TCP, m/s.
        turn_speed: Greatest angular speed of the hand, rad/s.
        acceleration: Greatest acceleration of the TCP, m/s^2.
        turn_acceleration: Greatest angular acceleration of the hand, rad/s^2.
        joint_speed: (7,) greatest joint speeds, rad/s; the motion takes longer instead.
        lower: (7,) joint limits, radians.
        upper: (7,) joint limits, radians.

    Raises:
        OutOfWorkspace: The line leaves the arm's reach or its joint limits; nothing moved.
    """
    here = forward_pose(start)
    distance, angle = pose_distance(here, goal)
    seconds = max(_duration(distance, speed, acceleration), _duration(angle, turn_speed, turn_acceleration))
    path = _along(start, here, goal, seconds, lower, upper)
    times = np.linspace(0, seconds, 4 * len(path.seconds))
    excess = float((np.abs(path.curve()(times, 1)) / joint_speed).max())
    if excess > 1.0:
        path = _along(start, here, goal, 1.02 * excess * seconds, lower, upper)
    return path


def _along(
    start: np.ndarray, here: Pose, goal: Pose, seconds: float, lower: np.ndarray, upper: np.ndarray
) -> JointPath:
    share = _profile(seconds)
    joints, error = track(straight_line(here, goal, share).as_matrix(), start)
    if not (error < POSE_TOLERANCE).all() or not within_limits(joints, lower, upper):
        target = ", ".join(f"{value:.3f}" for value in goal.position)
        raise OutOfWorkspace(
            f"no straight line from here to TCP ({target}) m within the joint limits; "
            "move to other joints first"
        )
    joints[0] = start
    return JointPath(seconds=np.linspace(0, seconds, len(share)), joints=joints)


def _profile(seconds: float) -> np.ndarray:
    """Fractions of the path at the knots: minimum jerk."""
    n = max(4, math.ceil(seconds / PERIOD_S))
    return minimum_jerk(np.arange(n + 1) / n)


def _duration(distance: float, peak_speed: float, peak_acceleration: float) -> float:
    return minimum_jerk_duration(distance, peak_speed, peak_acceleration, shortest_s=0.1)
