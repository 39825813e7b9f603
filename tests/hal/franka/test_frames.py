"""libfranka's matrices as our poses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hal.errors import NotConnected
from hal.franka import PandaPyArmConfig
from hal.franka.driver import column_major
from hal.franka.frames import F_T_EE, check_end_effector, matrix_from_columns, pose_from_columns, tool_along
from mskgrasp.core.geometry import Pose, quat_multiply
from mskgrasp.core.panda_kinematics import forward

PANDA = PandaPyArmConfig(driver="panda_py", host="x")
LOWER, UPPER = PANDA.joint_lower(), PANDA.joint_upper()
shares = st.lists(st.floats(0, 1), min_size=7, max_size=7)


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


def goal_from(start: np.ndarray, way: list[float], turn: list[float]) -> np.ndarray:
    """The pose after a shift and a turn, both in the frame at the start."""
    change = np.eye(4)
    change[:3, :3], change[:3, 3] = Rotation.from_rotvec(turn).as_matrix(), way
    return start @ change


small = st.lists(st.floats(-0.3, 0.3), min_size=3, max_size=3)


@settings(deadline=None, max_examples=50)
@given(shares, small, small)
def test_a_line_lies_on_an_axis_of_the_turned_tool(share: list[float], way: list[float], turn: list[float]):
    start = forward(LOWER + np.array(share) * (UPPER - LOWER))[0]
    tool = tool_along(start, goal_from(start, way, turn))
    assert tool[:3, :3] @ tool[:3, :3].T == pytest.approx(np.eye(3), abs=1e-9)
    assert not tool[:3, 3].any()
    length = np.linalg.norm(way)
    if length > 1e-3:
        assert np.abs(tool[:3, :3].T @ way).max() == pytest.approx(length, rel=1e-5)


@pytest.mark.parametrize(
    ("way", "turn"),
    [
        ([0, 0, 0.1], [0, 0, 0.5]),  # a descent of a vertical hand that turns
        ([-0.1, 0, 0], [0, 0, 0]),
        ([0, 0, 1e-6], [0, 0.3, 0]),
        ([1e-5, 1e-6, 0], [1e-6, 1e-5, 0]),
        ([2e-5, 0, 0.1], [3e-5, -3e-5, 0]),  # what is left of a motion before
    ],
)
def test_a_tool_that_moves_along_its_axes_is_not_turned(way: list[float], turn: list[float]):
    start = forward((LOWER + UPPER) / 2)[0]
    assert np.array_equal(tool_along(start, goal_from(start, way, turn)), np.eye(4))


def test_a_turn_across_the_line_lies_on_an_axis_too():
    start = forward((LOWER + UPPER) / 2)[0]
    tool = tool_along(start, goal_from(start, [0.05, 0.08, 0.02], [0.08, -0.05, 0.0]))
    turned = np.abs(tool[:3, :3].T @ [0.08, -0.05, 0.0])
    assert turned.max() == pytest.approx(np.linalg.norm(turned), rel=1e-5)
