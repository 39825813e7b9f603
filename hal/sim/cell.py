"""Simulated cell."""

from __future__ import annotations

import numpy as np

from hal.cell import Cell, Workspace
from hal.limits import ArmLimits
from hal.sim.arm import SapienArm
from hal.sim.camera import SapienCamera
from hal.sim.config import SapienCellConfig
from hal.sim.world import SapienWorld
from mskgrasp.core.panda_kinematics import JOINT_LOWER, JOINT_UPPER
from mskgrasp.core.settings import TABLE_Z


def sapien_cell(config: SapienCellConfig) -> Cell:
    """Build the simulated cell; nothing is simulated before it is connected."""
    home = np.array(config.home)
    world = SapienWorld(
        physics=config.physics,
        overhead=config.camera,
        region=config.region,
        home=home,
        part=config.part,
        seed=config.seed,
        tape=config.tape,
        colour_scale=config.colour_scale,
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
        camera=SapienCamera(world, config.noise),
        arm=SapienArm(world, limits),
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
        board_holder=world,
    )
