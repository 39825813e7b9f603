"""Kinematics, paths, frames and messages of the Franka arms, without a robot."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from hal.errors import NotConnected, OutOfWorkspace
from hal.franka import FrankyArmConfig, PandaPyArmConfig
from hal.franka.config import JOINT_SPEED
from hal.franka.driver import column_major
from hal.franka.faults import explain
from hal.franka.frames import F_T_EE, check_end_effector, matrix_from_columns, pose_from_columns
from hal.franka.path import joint_path, straight_path
from mskgrasp.core.geometry import Pose, quat_multiply
from mskgrasp.core.grasp import pose_base_tcp
from mskgrasp.core.panda_kinematics import JOINT_LOWER, JOINT_UPPER, forward, forward_pose, reachable, track

HOME = np.array([0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398])
PANDA = PandaPyArmConfig(driver="panda_py", host="x")
LOWER, UPPER = PANDA.joint_lower(), PANDA.joint_upper()
shares = st.lists(st.floats(0, 1), min_size=7, max_size=7)


@settings(deadline=None, max_examples=50)
@given(shares)
def test_numpy_arrays_and_torch_tensors_give_the_same_kinematics(share: list[float]):
    joints = LOWER + np.array(share) * (UPPER - LOWER)
    pose, jacobian = forward(joints)
    expected, expected_jacobian = forward(torch.tensor(joints))
    assert pose == pytest.approx(expected.numpy(), abs=1e-12)
    assert jacobian == pytest.approx(expected_jacobian.numpy(), abs=1e-12)


@settings(deadline=None, max_examples=50)
@given(shares)
def test_track_finds_joints_that_put_the_hand_back(share: list[float]):
    joints = HOME + 0.2 * (np.array(share) - 0.5)
    found, error = track(forward(joints)[0][None], HOME, iterations=20)
    assert error[0] < 1e-4
    assert forward(found[0])[0] == pytest.approx(forward(joints)[0], abs=2e-4)


def test_reach_ends_where_the_arm_does():
    assert reachable(pose_base_tcp(np.array([0.5, 0.1, 0.02, 0.5])), LOWER, UPPER)
    assert not reachable(pose_base_tcp(np.array([0.9, 0.3, 0.02, 0.0])), LOWER, UPPER)


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


@settings(deadline=None, max_examples=50)
@given(shares)
def test_libfrankas_columns_become_our_pose(share: list[float]):
    matrix = forward(LOWER + np.array(share) * (UPPER - LOWER))[0]
    values = [matrix[row, column] for column in range(4) for row in range(4)]
    assert column_major(matrix) == values
    pose = pose_from_columns(values)
    assert pose.position == pytest.approx(matrix[:3, 3])
    assert pose.as_matrix() == pytest.approx(matrix, abs=1e-9)


def test_quaternions_are_w_first():
    quarter = np.eye(4)
    quarter[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    assert pose_from_columns(column_major(quarter)).quat_wxyz == pytest.approx(
        [math.sqrt(0.5), 0, 0, math.sqrt(0.5)]
    )


def test_the_frankas_hand_is_the_only_end_effector():
    check_end_effector(column_major(F_T_EE))
    assert matrix_from_columns(column_major(F_T_EE)) == pytest.approx(F_T_EE)
    flange = np.eye(4)
    longer = F_T_EE + np.array([[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0.01], [0, 0, 0, 0]])
    turned = Pose.from_matrix(F_T_EE)
    turned = Pose(
        position=turned.position,
        quat_wxyz=quat_multiply(turned.quat_wxyz, np.array([math.cos(0.05), 0, 0, math.sin(0.05)])),
    ).as_matrix()
    for wrong in (flange, longer, turned):
        with pytest.raises(NotConnected, match="choose it in Desk") as caught:
            check_end_effector(column_major(wrong))
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("libfranka: Connection to FCI refused. Please install FCI feature.", "NotConnected"),
        ("libfranka: Connection error: Host not found", "NotConnected"),
        ("libfranka: UDP receive: Timeout", "CommunicationLost"),
        ("libfranka: server closed connection", "CommunicationLost"),
        ('libfranka: Move command aborted: motion aborted by reflex! ["cartesian_reflex"]', "MotionAborted"),
        ("libfranka: Move command preempted!", "MotionAborted"),
        ("Motion planner failed with error code -110", "NoTrajectory"),
        ("libfranka gripper: Command failed!", "MotionAborted"),
    ],
)  # fmt: skip
def test_a_vendors_text_has_one_meaning(text: str, kind: str):
    """The texts of libfranka 0.9.2 and 0.21.2, which both wrappers raise as plain RuntimeError at times."""
    error = explain(RuntimeError(text), "panda_py", "robot")
    assert type(error).__name__ == kind
    assert "\n" not in str(error)


def test_both_robots_have_their_own_limits():
    fr3 = FrankyArmConfig(driver="franky", host="x", robot="fr3", joint_margin=0.0)
    panda = FrankyArmConfig(driver="franky", host="x", robot="panda", joint_margin=0.0)
    assert panda.joint_lower() == pytest.approx(JOINT_LOWER)
    assert panda.joint_upper() == pytest.approx(JOINT_UPPER)
    assert fr3.joint_lower()[5] == pytest.approx(0.5445)  # FR3: joint 6 does not reach zero
    assert (LOWER > panda.joint_lower()).all() and (UPPER < panda.joint_upper()).all()


def test_neither_vendor_nor_simulator_is_imported_before_an_arm_connects():
    code = (
        "import sys\n"
        "for name in ('franky', 'panda_py', 'sapien', 'mani_skill', 'torch'): sys.modules[name] = None\n"
        "import hal, hal.devices, hal.franka, hal.franka.worker, hal.franka.franky_driver\n"
        "import hal.franka.panda_py_driver\n"
        "from hal.limits import ArmLimits\n"
        "hal.franka.FrankaArm(hal.franka.FrankyArmConfig(driver='franky', host='x'), None)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
