"""Paths of a Franka arm: straight, bounded, at rest at both ends."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hal.errors import OutOfWorkspace
from hal.franka import PandaPyArmConfig
from hal.franka.config import JOINT_SPEED
from hal.franka.path import joint_path, straight_path
from mskgrasp.core.grasp import pose_base_tcp
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
    assert not path.speeds[0].any() and not path.speeds[-1].any()
    assert (np.abs(path.speeds) <= 0.3 * JOINT_SPEED * 1.05).all()
    begin = forward_pose(HOME).position
    way = (goal.position - begin) / np.linalg.norm(goal.position - begin)
    points = np.array([forward_pose(joints).position for joints in path.joints])
    along = (points - begin) @ way
    assert np.linalg.norm(points - begin - along[:, None] * way, axis=1).max() < 1e-5
    assert (np.diff(along) / np.diff(path.seconds)).max() <= 0.25 * 1.01


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
    assert (np.abs(path.speeds).max(axis=0) <= speed * 1.001).all()
    numeric = np.gradient(path.speeds, path.seconds[1], axis=0)
    assert (np.abs(numeric) <= acceleration * 1.05).all()
    assert path.speeds[1:-1] == pytest.approx(
        np.gradient(path.joints, path.seconds[1], axis=0)[1:-1], abs=0.02
    )


def test_joints_that_all_but_stand_are_left_standing():
    goal = HOME + np.array([0.05, 1e-7, -3e-6, 0.0, 1e-5, 1e-4, 0.0])
    path = joint_path(HOME, goal, speed=np.ones(7), acceleration=np.ones(7))
    quiet = path.without_creep()
    moves = np.array([True, False, False, False, False, True, False])
    assert np.array_equal(quiet.joints[:, moves], path.joints[:, moves])
    assert np.array_equal(quiet.speeds[:, moves], path.speeds[:, moves])
    assert (quiet.joints[:, ~moves] == HOME[~moves]).all() and not quiet.speeds[:, ~moves].any()
