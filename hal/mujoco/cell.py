"""Cell simulated in MuJoCo, and its configuration."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from hal.cell import Cell, Workspace
from hal.limits import ArmLimits
from hal.mujoco.arm import MujocoArm
from hal.mujoco.camera import MujocoCamera
from hal.mujoco.settings import MujocoPhysics
from hal.mujoco.world import MujocoWorld
from hal.sensor_noise import SensorNoise
from mskgrasp.core.config import Config
from mskgrasp.core.panda_kinematics import JOINT_LOWER, JOINT_UPPER, top_down
from mskgrasp.core.settings import REGION, TABLE_Z, Overhead

READY = (0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398)
"""The Panda's usual ready pose, radians: the hand is behind the camera's field of view."""


class MujocoCellConfig(Config):
    """Settings of the cell simulated in MuJoCo."""

    type: Literal["mujoco"]
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
    physics: MujocoPhysics = MujocoPhysics()
    """Settings of the physics."""
    camera: Overhead = Overhead()
    """The overhead depth camera."""
    noise: SensorNoise = SensorNoise()
    """Noise model of the camera: off, iid (3 mm) or kinect2; see docs/sensor_noise.md."""

    @model_validator(mode="after")
    def _check(self) -> MujocoCellConfig:
        self.camera.check_sees(self.region)
        corners = [(x, y) for x in self.region[:2] for y in self.region[2:]]
        grasps = np.array([[x, y, z, t] for x, y in corners for z in (0.0105, 0.3) for t in (-1.57, 1.57)])
        if not top_down(grasps)[1].all():
            raise ValueError(f"region {list(self.region)} reaches beyond the arm")
        return self


def mujoco_cell(config: MujocoCellConfig) -> Cell:
    """Build the simulated cell; nothing is simulated before it is connected."""
    home = np.array(config.home)
    world = MujocoWorld(
        physics=config.physics,
        overhead=config.camera,
        region=config.region,
        home=home,
        part=config.part,
        seed=config.seed,
    )
    limits = ArmLimits(
        joint_lower=np.array(JOINT_LOWER),
        joint_upper=np.array(JOINT_UPPER),
        box_lower=np.array([0.25, -0.4, TABLE_Z]),
        box_upper=np.array([0.75, 0.4, 0.75]),
        table_z=TABLE_Z,
        max_force=70.0,
    )
    return Cell(
        camera=MujocoCamera(world, config.noise),
        arm=MujocoArm(world, limits),
        workspace=Workspace(
            table_z=TABLE_Z,
            region=config.region,
            home=home,
            min_height=config.noise.least_height if config.min_height is None else config.min_height,
            lift_height=config.lift_height,
            grasp_force=config.grasp_force,
        ),
        feeder=world,
        tracker=world,
    )
