"""Paths of a Franka arm: straight, bounded, at rest at both ends."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hal.errors import OutOfWorkspace
from hal.franka import PandaPyArmConfig
from hal.franka.config import JOINT_SPEED
from hal.franka.path import Peaks, joint_path, straight_path
from mskgrasp.core.grasp import pose_base_tcp
from mskgrasp.core.minimum_jerk import minimum_jerk
from mskgrasp.core.panda_kinematics import forward_pose

HOME = np.array([0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398])
PANDA = PandaPyArmConfig(driver="panda_py", host="x")
LOWER, UPPER = PANDA.joint_lower(), PANDA.joint_upper()


@settings(deadline=None, max_examples=25)
@given(st.floats(-0.1, 0.1), st.floats(-0.15, 0.15), st.floats(0.05, 0.4), st.floats(-1.2, 1.2))
def test_a_straight_path_is_straight_slow_enough_and_ends_at_its_goal(x, y, z, theta):
    goal = pose_base_tcp(np.array([0.45 + x, y, z, theta]))
    path = straight_path(
        HOME, goal, speed=0.25, turn_speed=1.0, acceleration=1.0, turn_acceleration=2.0,
        joint_speed=0.3 * JOINT_SPEED, lower=LOWER, upper=UPPER,
    )  # fmt: skip
    assert forward_pose(path.joints[-1]).position == pytest.approx(goal.position, abs=1e-6)
    assert np.abs(path.joints[0] - HOME).max() == 0
    curve, times = path.curve(), np.linspace(0, path.duration_s, 10 * len(path.seconds))
    assert (np.abs(curve(times, 1)) <= 0.3 * JOINT_SPEED * 1.05).all()
    begin = forward_pose(HOME).position
    way = (goal.position - begin) / np.linalg.norm(goal.position - begin)
    points = forward_pose(curve(times)).position  # also between the knots
    along = (points - begin) @ way
    assert np.linalg.norm(points - begin - along[:, None] * way, axis=1).max() < 1e-5
    assert (np.diff(along) / np.diff(times)).max() <= 0.25 * 1.01


def test_a_line_through_a_place_out_of_reach_is_refused():
    """From in front of the base to its side, both in reach, right through the base."""
    start = HOME + np.array([-1.4, 0, 0, 0, 0, 0, 0])
    behind = forward_pose(HOME + np.array([1.7, 0, 0, 0, 0, 0, 0]))
    with pytest.raises(OutOfWorkspace, match="no straight line"):
        straight_path(
            start, behind, speed=0.2, turn_speed=1.0, acceleration=1.0, turn_acceleration=2.0,
            joint_speed=JOINT_SPEED, lower=LOWER, upper=UPPER,
        )  # fmt: skip


def test_a_joint_path_keeps_speed_and_acceleration():
    goal = HOME + np.array([0.5, -0.2, 0.1, 0.3, 0.0, 0.4, -0.6])
    speed, acceleration = 0.3 * JOINT_SPEED, np.full(7, 2.0)
    path = joint_path(HOME, goal, speed=speed, acceleration=acceleration)
    assert path.joints[-1] == pytest.approx(goal)
    curve, times = path.curve(), np.linspace(0, path.duration_s, 1000)
    assert (np.abs(curve(times, 1)) <= speed * 1.001).all()
    assert (np.abs(curve(times, 2)) <= acceleration * 1.001).all()


def test_a_path_starts_and_ends_without_speed_and_acceleration_which_has_no_steps_between():
    goal = pose_base_tcp(np.array([0.5, 0.1, 0.1, 0.5]))
    path = straight_path(
        HOME, goal, speed=0.25, turn_speed=1.0, acceleration=1.0, turn_acceleration=2.0,
        joint_speed=0.3 * JOINT_SPEED, lower=LOWER, upper=UPPER,
    )  # fmt: skip
    curve, times = path.curve(), np.arange(0, path.duration_s, 1e-3)
    for order in (1, 2):
        assert np.abs(curve([0, path.duration_s], order)).max() < 1e-9
    accelerations = curve(times, 2)
    assert np.abs(np.diff(accelerations, axis=0)).max() < 0.03 * np.abs(accelerations).max()


def test_peaks_are_those_of_a_minimum_jerk_motion():
    t = np.linspace(0, 2, 2001)
    rates = [0.3 * minimum_jerk(t / 2)]
    for _ in range(3):
        rates.append(np.gradient(rates[-1], t))
    peaks = Peaks.of(np.array(0.3), 2)
    expected = [np.abs(rate[3:-3]).max() for rate in rates[1:]]
    assert [peaks.speed, peaks.acceleration, peaks.jerk] == pytest.approx(expected, rel=2e-2)
