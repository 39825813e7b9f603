"""The rendered depth of the block and of the arm over it."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pytest
import sapien

from hal.errors import NotConnected
from hal.sim.camera import SapienCamera
from hal.sim.world import SapienWorld
from mskgrasp.core.panda_kinematics import top_down
from mskgrasp.parts import Part
from tasks.scene.frames import to_world


@pytest.fixture
def camera(block_world: SapienWorld, block: Part) -> Iterator[SapienCamera]:
    """The block upright in the middle of the region, at (0.5, 0)."""
    block_world.present(str(block.folder), 0)
    block_world.env.part.set_pose(sapien.Pose(p=to_world(np.array([0.5, 0.0, 0.015]))))
    with SapienCamera(block_world) as camera:
        yield camera


def test_depth_is_that_of_the_block_on_the_table(camera: SapienCamera):
    """0.77 m to its top, 0.8 m to the table; 4 cm are 19 pixels along a row, 2 cm are 9.5 along a column."""
    before = time.monotonic()
    frame = camera.capture()
    assert before <= frame.timestamp_s <= time.monotonic()
    top = np.abs(frame.depth - 0.77) < 1e-5
    assert top.sum() == pytest.approx(0.04 * 0.02 * (365.5 / 0.77) ** 2, rel=0.08)
    rows, columns = np.nonzero(top)
    assert (rows.mean(), columns.mean()) == pytest.approx((79.5, 79.5), abs=0.5)
    assert np.ptp(rows) + 1 == pytest.approx(0.04 * 365.5 / 0.77, abs=1)
    assert frame.depth[5, 5] == pytest.approx(0.8, abs=1e-5)


def test_the_arm_is_in_the_picture_where_it_is_over_the_table(camera: SapienCamera, block_world: SapienWorld):
    block_world.env.motion.place(top_down(np.array([0.5, 0.0, 0.2, 0.0]))[0][None])
    depth = camera.capture().depth
    # The hand over the block, 0.3 m and more over the table, hides it.
    assert depth[79, 79] < 0.5 and np.nanmin(depth) < 0.5
    assert depth[5, 155] == pytest.approx(0.8, abs=1e-5)


def test_a_closed_camera_refuses_and_leaves_the_world_to_its_other_users(
    camera: SapienCamera, block_world: SapienWorld
):
    camera.close()
    camera.close()
    with pytest.raises(NotConnected, match="not connected"):
        camera.capture()
    assert block_world.part_pose().position[2] == pytest.approx(0.015, abs=1e-6)
