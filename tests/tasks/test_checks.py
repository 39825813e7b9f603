"""What a user gives the task is refused by name where it cannot be used."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mskgrasp.core.errors import BadConfig
from tasks.checks import check_reset, grasps_of, poses_of

POSE = [0.5, 0.0, 0.02, 1.0, 0.0, 0.0, 0.0]


def test_one_pose_may_be_given_flat_and_several_are_one_a_scene():
    assert np.array_equal(poses_of(POSE, 1), [POSE])
    assert np.array_equal(poses_of(torch.tensor([POSE, POSE]), 2), np.float32([POSE, POSE]))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([0.5, 0, 0.02, 0, 0, 0, 0], r"must have length 1, got \[0.0\]"),
        ([0.5, 0, 0.02, 2, 0, 0, 0], r"must have length 1, got \[2.0\]"),
        ([0.5, 0, float("nan"), 1, 0, 0, 0], "1 finite poses x y z qw qx qy qz"),
        ([POSE, POSE], r"got an array \(2, 7\)"),
        (POSE[:6], r"got an array \(6,\)"),
    ],
)
def test_what_is_no_pose_of_a_part_is_refused(given, message):
    with pytest.raises(BadConfig, match=message):
        poses_of(given, 1)


def test_an_unknown_option_of_a_reset_is_named():
    check_reset(dict(parts=["hex_nut_m30"], reconfigure=True, pose_base_obj=None))
    with pytest.raises(BadConfig, match="options: no pose_base_objct; legal: parts, "):
        check_reset(dict(pose_base_objct=POSE))
    with pytest.raises(BadConfig, match="with reconfigure=True alone"):
        check_reset(dict(parts=["hex_nut_m30"]))


def test_an_action_is_one_grasp_a_scene():
    assert grasps_of(torch.zeros(4), 1).shape == (1, 4) and grasps_of(torch.zeros(2, 4), 2).shape == (2, 4)
    for shape in ((3,), (2, 4), (1, 5)):
        with pytest.raises(BadConfig, match=r"is \(1, 4\), x y z theta"):
            grasps_of(torch.zeros(shape), 1)
