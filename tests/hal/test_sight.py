"""An arm in the camera's sight is named, whether it hides the table or stands over it."""

from __future__ import annotations

import numpy as np
import pytest

from hal import RgbdFrame, capture_at_home, open_cell
from hal.cell import Workspace
from hal.errors import ArmInView
from hal.sight import link_in_sight
from mskgrasp.core.panda_body import PANDA_LINKS
from mskgrasp.core.settings import REGION, TABLE_Z, Overhead
from mskgrasp.core.shipped import config_file

HOME = np.array([0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398])
STRETCHED = np.array([0.0, 0.0, 0.0, -2.0, 0.0, 1.9, 0.785])
CENTRE = (REGION[0] + REGION[1]) / 2, (REGION[2] + REGION[3]) / 2


def frame_of(overhead: Overhead) -> RgbdFrame:
    n = overhead.n_pixels
    return RgbdFrame(
        colour=np.zeros((n, n, 3), np.uint8), depth=np.full((n, n), overhead.height, np.float32),
        intrinsics=overhead.intrinsics(), T_base_camera=overhead.T_base_camera(CENTRE), timestamp_s=0.0,
        serial="drawn",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("height", "joints", "seen"),
    [
        (0.8, HOME, False),
        (0.75, HOME, False),
        (0.8, STRETCHED, True),
        (1.6, HOME, True),  # beside the region's table, but over the part's surroundings
    ],
)
def test_a_link_over_the_region_or_before_it_is_named(height, joints, seen):
    workspace = Workspace(
        table_z=TABLE_Z, region=REGION, home=HOME, min_height=0.002, lift_height=0.1, grasp_force=30.0
    )
    assert bool(link_in_sight(PANDA_LINKS, joints, frame_of(Overhead(height=height)), workspace)) is seen


def test_no_frame_is_taken_for_a_plan_where_home_is_in_sight(tmp_path):
    text = config_file("cells/mujoco.yaml").read_text(encoding="utf-8")
    file = tmp_path / "cell.yaml"
    file.write_text(f"{text}\nhome: {STRETCHED.tolist()}\n", encoding="utf-8")
    with open_cell(file) as cell, pytest.raises(ArmInView, match="choose other joints for workspace.home"):
        capture_at_home(cell)
