"""Configurations of the simulated cell and of its camera alone."""

from __future__ import annotations

from typing import Literal

import torch
from pydantic import Field, model_validator

from hal.sensor_noise import SensorNoise
from mskgrasp.core.config import Config
from mskgrasp.core.panda_kinematics import top_down
from mskgrasp.core.settings import REGION, Overhead, Physics, Tape

READY = (0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398)
"""The Panda's usual ready pose, radians: the hand is behind the camera's field of view."""


class SapienCellConfig(Config):
    """Settings of the simulated cell."""

    type: Literal["sapien"]
    part: str = "hex_nut_m30"
    """Part on the table when the cell is opened: a name or a folder."""
    seed: int = Field(default=0, ge=0)
    """Determines the position and turn of the part."""
    region: tuple[float, float, float, float] = REGION
    """x_min, x_max, y_min, y_max where parts lie, base frame, m."""
    home: tuple[float, float, float, float, float, float, float] = READY
    """Joints at which the arm is out of the camera's sight, rad."""
    min_height: float | None = Field(default=None, gt=0)
    """Points lower than this over the table count as table, m; null: 2 mm, or 3 mm with camera noise."""
    lift_height: float = Field(default=0.1, gt=0, le=0.3)
    """Height by which a grasped part is lifted, m."""
    grasp_force: float = Field(default=30.0, gt=0, le=70)
    """Gripper force, N."""
    physics: Physics = Physics()
    """Settings of the physics."""
    camera: Overhead = Overhead()
    """The overhead depth camera."""
    noise: SensorNoise = SensorNoise()
    """Noise model of the camera: off, iid (3 mm) or kinect2; see docs/sensor_noise.md."""
    tape: Tape | None = None
    """Two squares of white tape on top of every part, as markers; null: none. See docs/markers.md."""
    colour_scale: int = Field(default=1, ge=1, le=6)
    """Above 1, frames also hold a colour image finer than depth by this factor (a Kinect v2: 3)."""

    @model_validator(mode="after")
    def _check(self) -> SapienCellConfig:
        self.camera.check_sees(self.region)
        corners = [(x, y) for x in self.region[:2] for y in self.region[2:]]
        grasps = torch.tensor(
            [[x, y, z, t] for x, y in corners for z in (0.0105, 0.3) for t in (-1.57, 1.57)]
        )
        if not bool(top_down(grasps.double())[1].all()):
            raise ValueError(f"region {list(self.region)} reaches beyond the arm")
        return self


class SapienCameraConfig(Config):
    """A rendered table with a part on it, which the arm does not move."""

    driver: Literal["sapien"]
    part: str = "hex_nut_m30"
    """First part on the rendered table: a name or a folder."""
    seed: int = Field(default=0, ge=0)
    """Determines the position and turn of the part."""
    overhead: Overhead = Overhead()
    """Pose and optics of the camera."""
    noise: SensorNoise = SensorNoise()
    """Noise model: off, iid (3 mm) or kinect2; see docs/sensor_noise.md."""
