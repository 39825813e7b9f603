"""The board in the simulated hand is seen where the hand holds it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hal.charuco import Board, detect, project
from hal.sim.world import SapienWorld
from mskgrasp.core.geometry import Pose
from mskgrasp.core.panda_kinematics import forward_pose, top_down
from mskgrasp.parts import Part

BOARD = Board(columns=5, rows=4, square=0.024, marker=0.018)
MARGIN = 0.01
HELD = Pose(
    position=np.array([0.09, 0.01, -0.005]),
    quat_wxyz=Rotation.from_euler("xyz", [4, -3, 20], degrees=True).as_quat(scalar_first=True),
)


@pytest.fixture(scope="module")
def holding(block_world: SapienWorld, block: Part) -> SapienWorld:
    block_world.present(str(block.folder), 0)
    width, height = (edge + 2 * MARGIN for edge in BOARD.size)
    block_world.hold_board(BOARD.image(80, MARGIN), (width, height), HELD)
    return block_world


@pytest.mark.parametrize("grasp", [(0.42, 0.0, 0.2, 0.0), (0.45, -0.05, 0.1, 0.4), (0.43, 0.03, 0.3, -0.3)])
def test_corners_are_where_the_held_board_projects(holding: SapienWorld, grasp: tuple[float, ...]):
    joints = top_down(np.array(grasp))[0]
    holding.env.motion.place(joints[None])
    image = holding.fine_colour()
    assert image is not None
    found = detect(BOARD, image)
    assert len(found.ids) >= 10
    T_base_board = forward_pose(joints) @ HELD
    camera = holding.overhead.T_base_camera(holding.env.region_centre)
    expected = project(
        camera.inverse().apply(T_base_board.apply(BOARD.corners())), holding.overhead.intrinsics()
    )
    fine = (expected[found.ids] + 0.5) * 3 - 0.5
    assert np.sqrt(((found.pixels - fine) ** 2).sum(axis=1).mean()) < 0.5


def test_paper_is_white_and_not_overexposed(holding: SapienWorld):
    holding.env.motion.place(top_down(np.array([0.43, 0.0, 0.2, 0.0]))[0][None])
    image = holding.fine_colour()
    assert image is not None
    whites = image[image.min(axis=-1) > 150]
    assert len(whites) > 2000 and (whites == 255).mean() < 0.05


def test_the_back_of_the_board_shows_no_pattern(block_world: SapienWorld, block: Part):
    joints = top_down(np.array([0.43, 0.0, 0.2, 0.0]))[0]
    seen = []
    for held in (HELD, HELD @ Pose(position=np.zeros(3), quat_wxyz=np.array([0.0, 1.0, 0.0, 0.0]))):
        block_world.present(str(block.folder), 0)
        block_world.hold_board(BOARD.image(80, MARGIN), BOARD.size, held)
        block_world.env.motion.place(joints[None])
        image = block_world.fine_colour()
        assert image is not None
        seen.append(len(detect(BOARD, image).ids))
    assert seen[0] >= 10 and seen[1] == 0
