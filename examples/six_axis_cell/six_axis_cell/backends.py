"""Settings of both devices, and what the entry points of pyproject.toml name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydantic import Field

from hal import Backend, BackendConfig
from hal.config import WorkspaceConfig
from mskgrasp import Pose
from six_axis_cell.arm import HAND, LOWER, UPPER, SixAxisArm
from six_axis_cell.camera import DepthCamera, FlatTable


class SixAxisConfig(BackendConfig):
    """Section ``arm`` of a cell's file with ``driver: six_axis``."""

    pace: float = Field(default=1.0, gt=0, le=100)
    """Time runs this much faster: the arm is simulated."""


class DepthDeviceConfig(BackendConfig):
    """Section ``camera`` of a cell's file with ``driver: depth_device``."""

    position: tuple[float, float, float]
    """Position in the base of a camera that looks straight down, metres."""


def make_arm(config: SixAxisConfig, workspace: WorkspaceConfig) -> SixAxisArm:
    limits = workspace.limits(
        joint_lower=LOWER, joint_upper=UPPER, max_force=HAND.force[1], gripper=HAND, max_load=2.0
    )
    return SixAxisArm(limits, config.pace)


def make_camera(config: DepthDeviceConfig, cell_file: Path) -> DepthCamera:
    down = np.array([0.0, 1.0, 0.0, 0.0])
    pose = Pose(position=np.array(config.position), quat_wxyz=down)
    return DepthCamera(FlatTable(config.position[2]), pose)


SIX_AXIS = Backend(config=SixAxisConfig, make=make_arm)
DEPTH_DEVICE = Backend(config=DepthDeviceConfig, make=make_camera)
