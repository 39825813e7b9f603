"""Simulated cell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hal.cell import Cell
from hal.sim.arm import SapienArm
from hal.sim.camera import SapienCamera
from hal.sim.config import SapienCellConfig
from hal.sim.world import SapienWorld
from hal.simulated import cell_limits, simulated_cell


def sapien_cell(config: SapienCellConfig) -> Cell:
    """Build the simulated cell; nothing is simulated before it is connected."""
    world = SapienWorld(
        physics=config.physics,
        overhead=config.camera,
        region=config.region,
        home=np.array(config.home),
        part=config.part,
        seed=config.seed,
        table_error=config.table_error,
        tape=config.tape,
        colour_scale=config.colour_scale,
    )
    camera, arm = SapienCamera(world, config.noise), SapienArm(world, cell_limits(config, world))
    return replace(
        simulated_cell(config, world, camera, arm, config.physics, board_holder=world), draws_tape=True
    )
