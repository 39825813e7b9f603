"""The exported file has the fields of the format, and hand poses that hold the part."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from mskgrasp.core.geometry import Pose
from mskgrasp.core.panda_kinematics import TCP_OFFSET
from mskgrasp.planning.isaac_grasp import write_isaac_grasp
from tests.planning.test_certified import PART, certified, certified_grasp


def test_a_hand_stands_over_the_part_with_its_fingers_down(tmp_path):
    grasp = certified_grasp()
    write_isaac_grasp(tmp_path / "grasps.yaml", PART, certified(grasp))
    values = yaml.safe_load((tmp_path / "grasps.yaml").read_text())
    assert (values["format"], values["format_version"]) == ("isaac_grasp", 1.0)
    ((name, found),) = values["grasps"].items()
    assert name == "grasp_0_pose_0"
    assert found["confidence"] == pytest.approx(24 / 26, abs=1e-4)
    assert found["pregrasp_cspace_position"]["panda_finger_joint1"] == pytest.approx(0.04)
    quat = np.array([found["orientation"]["w"], *found["orientation"]["xyz"]])
    hand = Pose(position=np.array(found["position"]), quat_wxyz=quat)
    lying = Pose(
        position=np.array([0.0, 0.0, PART.resting.position[0, 2]]), quat_wxyz=PART.resting.quat_wxyz[0]
    )
    # Between the pads, in the frame of the table: the grasp point, and the hand above it.
    between = (lying @ hand).apply(np.array([0.0, 0.0, TCP_OFFSET]))
    assert between == pytest.approx(grasp.grasp[:3], abs=1e-9)
    assert (lying @ hand).position[2] == pytest.approx(grasp.grasp[2] + TCP_OFFSET)
    across = (lying @ hand).apply(np.array([0.0, 1.0, 0.0])) - (lying @ hand).position
    theta = grasp.grasp[3]
    assert abs(across @ [-np.sin(theta), np.cos(theta), 0.0]) == pytest.approx(1.0)
