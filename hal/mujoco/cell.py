"""Cell simulated in MuJoCo."""

from __future__ import annotations

import numpy as np

from hal.cell import Cell
from hal.mujoco.arm import MujocoArm
from hal.mujoco.camera import MujocoCamera
from hal.mujoco.config import MujocoCellConfig
from hal.mujoco.world import MujocoWorld
from hal.simulated import cell_limits, simulated_cell


def mujoco_cell(config: MujocoCellConfig) -> Cell:
    """Build the simulated cell; nothing is simulated before it is connected."""
    world = MujocoWorld(
        physics=config.physics,
        overhead=config.camera,
        region=config.region,
        home=np.array(config.home),
        part=config.part,
        seed=config.seed,
        table_error=config.table_error,
    )
    camera, arm = MujocoCamera(world, config.noise), MujocoArm(world, cell_limits(config, world))
    return simulated_cell(config, world, camera, arm, config.physics)
