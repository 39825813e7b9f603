"""libfranka's matrices as our poses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hal.errors import NotConnected
from hal.franka import PandaPyArmConfig
from hal.franka.driver import column_major
from hal.franka.frames import F_T_EE, check_end_effector, matrix_from_columns, pose_from_columns
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
