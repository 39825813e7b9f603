"""Parts on the table of the MuJoCo cell."""

from __future__ import annotations

import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hal.config import READY, TableError
from hal.errors import NotConnected
from hal.mujoco import MujocoCellConfig, mujoco_cell
from hal.mujoco.world import MujocoWorld
from mskgrasp.core.errors import BadPart
from mskgrasp.core.geometry import pose_distance
from mskgrasp.parts import Part
from tests.hal.mujoco.conftest import MakeBox

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
    assert "EXTRAS=dev,mujoco" in done.stdout, done.stderr


def world_of(part: Part) -> MujocoWorld:
    world = mujoco_cell(MujocoCellConfig(type="mujoco", part=str(part.folder))).feeder
    assert isinstance(world, MujocoWorld)
    return world


def test_a_world_lives_from_its_first_user_to_its_last(box: MakeBox):
    world = world_of(box((0.03, 0.02, 0.04), 0.05))
    with pytest.raises(NotConnected, match="the simulated cell is closed"):
        world.part_pose()
    world.open()
    first = world.simulation
    world.open()
    world.close()
    assert world.simulation is first
    world.close()
    world.close()
    with pytest.raises(NotConnected):
        world.part_pose()


def test_a_part_lies_at_rest_in_the_region_where_its_seed_says(box: MakeBox):
    part = box((0.06, 0.04, 0.01), 0.05)
    world = world_of(part)
    world.open()
    x_min, x_max, y_min, y_max = world.region
    poses = []
    for seed in (1, 2, 1):
        world.present(str(part.folder), seed)
        pose = world.part_pose()
        poses.append(pose.as_vector())
        # Every corner over the table and in the region, the lowest on the table.
        corners = pose.apply(np.array(list(itertools.product((-0.03, 0.03), (-0.02, 0.02), (-0.005, 0.005)))))
        assert corners[:, 2].min() == pytest.approx(0, abs=2e-5)
        assert (corners[:, :2] > [x_min - 1e-4, y_min - 1e-4]).all()
        assert (corners[:, :2] < [x_max + 1e-4, y_max + 1e-4]).all()
        assert np.abs(world.simulation.data.qvel).max() < 0.02
        assert world.simulation.joints == pytest.approx(READY, abs=1e-4)
    assert np.array_equal(poses[0], poses[2]) and not np.allclose(poses[0], poses[1], atol=1e-3)
    assert (world.presented, world.presented_seed) == (4, 1)  # the first when it was opened


def test_a_part_that_fell_off_the_table_is_not_kept(box: MakeBox):
    part = box((0.03, 0.02, 0.04), 0.05)
    world = world_of(part)
    world.open()
    world.simulation.data.qpos[9:12] = 0.5, 0.5, -0.2
    world.present(str(part.folder), 1, keep=True)
    assert len(world.simulation.parts) == 1


def test_an_unknown_part_is_refused_and_the_table_stays_as_it_is(box: MakeBox):
    world = world_of(box((0.03, 0.02, 0.04), 0.05))
    world.open()
    before = world.simulation
    with pytest.raises(BadPart, match="no_such_part"):
        world.present("no_such_part", 2)
    assert world.simulation is before and world.presented_seed == 0


def test_a_part_lies_on_a_table_with_an_error():
    """3 mm higher, and by the slope more or less where the part lies."""
    flat, wrong = (
        mujoco_cell(CONFIG.model_copy(update={"table_error": error}))
        for error in (TableError(), TableError(height=0.003, slope=(0.01, 0.0)))
    )
    with flat.connected(), wrong.connected():
        assert flat.tracker is not None and wrong.tracker is not None
        level, moved = flat.tracker.part_pose(), wrong.tracker.part_pose()
    rise = 0.003 + 0.01 * (moved.position[0] - 0.5)
    assert moved.position[2] - level.position[2] == pytest.approx(rise, abs=2e-4)
    assert pose_distance(level, moved)[1] == pytest.approx(0.01, abs=1e-3)
