"""Paths of the arm: joint angles over time, minimum jerk."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hal.errors import OutOfWorkspace
from mskgrasp.core.geometry import Pose, pose_distance, straight_line
from mskgrasp.core.minimum_jerk import minimum_jerk, minimum_jerk_duration, minimum_jerk_rate
from mskgrasp.core.panda_kinematics import POSE_TOLERANCE, forward_pose, track, within_limits

PERIOD_S = 0.05
"""Time between two knots of a path, s: a cubic between them is off by less than 0.1 mm at 0.5 m/s."""

CREEP_RAD = 2e-5
"""A joint that moves by less over a whole path is held, rad: 0.02 mm at the hand."""


@dataclass(frozen=True, kw_only=True)
class JointPath:
    """Knots of a motion, evenly spaced in time; the first is the current position.

    Attributes:
        seconds: (k,) since the start.
        joints: (k, 7) radians.
        speeds: (k, 7) radians a second; zero at both ends.
    """

    seconds: np.ndarray
    joints: np.ndarray
    speeds: np.ndarray

    @property
    def duration_s(self) -> float:
        """Seconds from the first knot to the last."""
        return float(self.seconds[-1])

    def without_creep(self) -> JointPath:
        """The same path with joints held that move by less than `CREEP_RAD`.

        A profile over a millionth of a radian is at the end of a trajectory solver's accuracy: Ruckig, which
        franky uses, sometimes finds none on such a path (error -111), which aborts the motion.
        """
        still = np.ptp(self.joints, axis=0) < CREEP_RAD
        return JointPath(
            seconds=self.seconds,
            joints=np.where(still, self.joints[0], self.joints),
            speeds=np.where(still, 0.0, self.speeds),
        )


def joint_path(
    start: np.ndarray, goal: np.ndarray, *, speed: np.ndarray, acceleration: np.ndarray
) -> JointPath:
    """All joints from (7,) to (7,) radians together, under speeds (7,) rad/s and accelerations (7,)."""
    way = goal - start
    seconds = max(_duration(abs(way[i]), speed[i], acceleration[i]) for i in range(7))
    share, rate = _profile(seconds)
    times = np.linspace(0, seconds, len(share))
    return JointPath(seconds=times, joints=start + share[:, None] * way, speeds=rate[:, None] * way)


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
    excess = float((np.abs(path.speeds) / joint_speed).max())
    if excess > 1.0:
        path = _along(start, here, goal, 1.02 * excess * seconds, lower, upper)
    return path


def _along(
    start: np.ndarray, here: Pose, goal: Pose, seconds: float, lower: np.ndarray, upper: np.ndarray
) -> JointPath:
    share, _ = _profile(seconds)
    joints, error = track(straight_line(here, goal, share).as_matrix(), start)
    if not (error < POSE_TOLERANCE).all() or not within_limits(joints, lower, upper):
        target = ", ".join(f"{value:.3f}" for value in goal.position)
        raise OutOfWorkspace(
            f"no straight line from here to TCP ({target}) m within the joint limits; "
            "move to other joints first"
        )
    joints[0] = start
    speeds = np.gradient(joints, seconds / (len(share) - 1), axis=0)
    speeds[0] = speeds[-1] = 0.0
    return JointPath(seconds=np.linspace(0, seconds, len(share)), joints=joints, speeds=speeds)


def _profile(seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Fractions of the path and their rate at the knots: minimum jerk."""
    n = max(4, math.ceil(seconds / PERIOD_S))
    t = np.arange(n + 1) / n
    return minimum_jerk(t), minimum_jerk_rate(t) / seconds


def _duration(distance: float, peak_speed: float, peak_acceleration: float) -> float:
    return minimum_jerk_duration(distance, peak_speed, peak_acceleration, shortest_s=0.1)
