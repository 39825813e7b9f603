from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hal.arm import Arm
from hal.errors import OutOfWorkspace
from hal.gripper import FRANKA_HAND
from mskgrasp.core.grasp import HAND_GEOMETRY, pose_base_tcp
from tests.hal.replay.toy import ToyArm

WIDE = replace(FRANKA_HAND, stroke=0.14, pad_reach=0.03, force=(10.0, 60.0))


def arm_with(gripper) -> Arm:
    arm = ToyArm()
    arm.limits = replace(arm.limits, gripper=gripper)
    return arm


def test_corners_are_the_collision_boxes_of_the_pandas_open_hand():
    pads, palm = FRANKA_HAND.corners[:4], FRANKA_HAND.corners[4:]
    assert np.abs(pads) == pytest.approx(np.tile([0.011, 0.056, 0.0095], (4, 1)), abs=1e-12)
    assert np.abs(palm) == pytest.approx(np.tile([0.032, 0.102, 0.0375], (4, 1)), abs=1e-12)
    assert pads[:, 2].min() > 0 > palm[:, 2].max()


def test_the_franka_hand_has_the_dimensions_that_datasets_store():
    assert FRANKA_HAND.geometry == pytest.approx(HAND_GEOMETRY, abs=1.5e-4)
    assert FRANKA_HAND.geometry.keys() == HAND_GEOMETRY.keys()


def test_widths_and_forces_are_those_of_the_arms_gripper():
    with arm_with(WIDE) as arm:
        arm.move_gripper(0.12)
        assert arm.state().gripper_width == 0.12
        arm.open_gripper()
        assert arm.state().gripper_width == 0.14
        with pytest.raises(OutOfWorkspace, match=r"0\.15 m is outside 0 \.\. 0\.14 m"):
            arm.move_gripper(0.15)
        with pytest.raises(OutOfWorkspace, match=r"5 N is outside 10 \.\. 70 N"):
            arm.grasp(5.0)


def test_longer_pads_keep_the_hand_higher_over_the_table():
    low = pose_base_tcp(np.array([0.4, 0.0, 0.02, 0.0]))
    arm_with(FRANKA_HAND).check_pose(low)
    with pytest.raises(OutOfWorkspace, match="would bring the hand -10.0 mm over the table"):
        arm_with(WIDE).check_pose(low)
