"""Placed parts beside the region: they stay while the next part is presented, and can be pushed."""

from __future__ import annotations

import numpy as np
import sapien

from hal.sim import SapienCellConfig, sapien_cell
from hal.sim.world import SapienWorld
from tasks.scene.frames import base_pose, to_world

CONFIG = SapienCellConfig(type="sapien", part="hex_nut_m30")


def put(world: SapienWorld, x: float, y: float) -> np.ndarray:
    """Moves the part presented last, as an arm would; returns its place."""
    pose = world.part_pose()
    position = np.array([x, y, pose.position[2]])
    world.env.part.set_pose(sapien.Pose(p=to_world(position), q=pose.quat_wxyz))
    return position


def beside(world: SapienWorld) -> list[np.ndarray]:
    return [base_pose(lying.body).position[0].numpy() for lying in world._beside]


def test_what_lies_beside_the_region_stays_and_what_lies_in_it_is_cleared_away():
    cell = sapien_cell(CONFIG)
    world = cell.feeder
    assert isinstance(world, SapienWorld)
    with cell.connected():
        first = put(world, 0.45, 0.22)
        world.present("hex_nut_m30", 1, keep=True)  # the same part again: bodies must not share a name
        assert len(beside(world)) == 1
        world.present("washer_m36", 2, keep=True)  # the second nut was left in the region
        assert len(beside(world)) == 1
        second = put(world, 0.55, -0.3)
        world.present("hex_nut_m30", 3, keep=True)
        world.env.motion.step(200)
        np.testing.assert_allclose(beside(world), [first, second], atol=2e-4)

        before = world.part_pose()
        world.present("hex_nut_m30", 3)
        assert beside(world) == []
        # What lies beside changes nothing for the part: where it lies follows from the seed alone.
        np.testing.assert_allclose(world.part_pose().position, before.position, atol=1e-4)


def test_a_part_beside_can_be_pushed():
    cell = sapien_cell(CONFIG)
    world = cell.feeder
    assert isinstance(world, SapienWorld)
    with cell.connected():
        put(world, 0.45, 0.25)
        world.present("hex_nut_m30", 1, keep=True)
        put(world, 0.45, 0.25 + 0.040)  # 6 mm into the other
        world.env.motion.step(100)
        assert beside(world)[0][1] < 0.248
