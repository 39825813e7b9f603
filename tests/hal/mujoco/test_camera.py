"""The camera of the MuJoCo cell against that of the SAPIEN cell."""

from __future__ import annotations

import numpy as np
import pytest

from hal import Cell
from hal.mujoco import MujocoCellConfig, mujoco_cell
from hal.sim import SapienCellConfig, sapien_cell

CONFIG = MujocoCellConfig(type="mujoco")


def test_a_seed_places_a_part_alike_in_both_simulated_cells_and_both_cameras_see_the_same(both):
    mine, other = both
    with mine.camera, other.camera:
        for part, seed in (("hex_nut_m30", 7), ("washer_m36", 8)):
            frames, poses = [], []
            for cell in both:
                cell.feeder.present(part, seed)
                frames.append(cell.camera.capture())
                poses.append(cell.tracker.part_pose())
            assert poses[0].position == pytest.approx(poses[1].position, abs=2e-5)
            assert abs(np.dot(poses[0].quat_wxyz, poses[1].quat_wxyz)) == pytest.approx(1.0, abs=1e-6)
            first, second = frames
            assert first.intrinsics.tolist() == second.intrinsics.tolist()
            assert first.T_base_camera.as_vector().tolist() == second.T_base_camera.as_vector().tolist()
            apart = np.abs(first.depth - second.depth)
            # A pixel whose ray grazes an edge may fall to either side of it.
            assert np.quantile(apart, 0.995) < 2e-5 and (apart > 1e-3).mean() < 0.003


@pytest.fixture(scope="module")
def both() -> tuple[Cell, Cell]:
    return mujoco_cell(CONFIG), sapien_cell(SapienCellConfig(type="sapien"))
