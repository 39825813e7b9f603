"""What lies on the table of the MuJoCo cell."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hal.mujoco import MujocoCellConfig, mujoco_cell
from hal.mujoco.world import MujocoWorld

CONFIG = MujocoCellConfig(type="mujoco")


def test_what_lies_beside_the_region_stays_and_what_lies_in_it_is_cleared_away():
    cell = mujoco_cell(CONFIG)
    world = cell.feeder
    assert isinstance(world, MujocoWorld)

    def put(x: float, y: float) -> np.ndarray:
        world.simulation.data.qpos[9:11] = x, y
        return world.part_pose().position

    with cell.connected():
        first = put(0.45, 0.22)
        world.present("hex_nut_m30", 1, keep=True)
        world.present("washer_m36", 2, keep=True)  # the second nut was left in the region
        second = put(0.55, -0.3)
        world.present("hex_nut_m30", 3, keep=True)
        kept = [world.simulation.part_pose(i).position for i in range(1, len(world.simulation.parts))]
        assert sorted(map(tuple, np.round(kept, 4))) == sorted(map(tuple, np.round([first, second], 4)))
        before = world.part_pose()
        world.present("hex_nut_m30", 3)
        assert len(world.simulation.parts) == 1
        # What lies beside changes nothing for the part.
        assert world.part_pose().position == pytest.approx(before.position, abs=1e-6)


def test_without_mujoco_the_cell_names_the_extra_and_nothing_else_needs_it():
    code = (
        "import sys; sys.modules['mujoco'] = None\n"
        "from pathlib import Path\n"
        "from hal import cell_from_yaml\n"
        "from hal.errors import DriverMissing\n"
        f"cell = cell_from_yaml(Path({str(Path(__file__).parents[3] / 'configs/cells/mujoco.yaml')!r}))\n"
        "try: cell.arm.connect()\n"
        "except DriverMissing as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "mskgrasp[mujoco]" in done.stdout, done.stderr
