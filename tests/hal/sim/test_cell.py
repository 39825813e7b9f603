"""Settings of the simulated cell, and what is derived from them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hal import SensorNoise
from hal.sim import SapienCellConfig, sapien_cell
from mskgrasp.core.grasp import lowest_grasp_z, pose_base_tcp
from mskgrasp.core.panda_kinematics import reachable


@pytest.mark.parametrize(
    ("settings", "height"),
    [
        ({}, 0.002),
        (dict(noise=SensorNoise(model="iid")), 0.003),
        (dict(noise=SensorNoise(model="kinect2"), min_height=0.006), 0.006),
    ],
)
def test_what_is_taken_for_table_is_higher_for_a_noisy_camera(settings: dict[str, Any], height: float):
    assert sapien_cell(SapienCellConfig(type="sapien", **settings)).workspace.min_height == height


def test_the_arm_reaches_every_grasp_in_the_region_and_its_box_holds_them():
    cell = sapien_cell(SapienCellConfig(type="sapien"))
    limits, (x_min, x_max, y_min, y_max) = cell.arm.limits, cell.workspace.region
    for x in np.linspace(x_min, x_max, 5):
        for y in np.linspace(y_min, y_max, 5):
            for theta in (-1.5, 0.0, 1.5):
                for z in (lowest_grasp_z(0.0), 0.15):
                    pose = pose_base_tcp(np.array([x, y, z, theta]))
                    cell.arm.check_pose(pose)
                    assert reachable(pose, limits.joint_lower, limits.joint_upper)
