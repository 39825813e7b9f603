"""Settings that all simulated cells share, and those of a table."""

from __future__ import annotations

import numpy as np
import pytest

from hal.arm import POSITION_TOLERANCE
from hal.config import READY, SimulatedCellConfig, TableError, WorkspaceConfig
from mskgrasp.core.grasp import TABLE_CLEARANCE


def test_simulated_and_real_cells_have_the_same_home():
    assert SimulatedCellConfig().home == WorkspaceConfig(table_z=0.0).home == READY


@pytest.mark.parametrize(
    ("region", "message"),
    [((0.5, 0.74, 0.3, 0.54), "reaches beyond the arm"), ((0.33, 0.7, -0.1, 0.1), "the camera sees 0.35 m")],
)
def test_a_region_that_arm_or_camera_cannot_use_is_refused(
    region: tuple[float, float, float, float], message: str
):
    with pytest.raises(ValueError, match=message):
        SimulatedCellConfig(region=region)


def test_the_box_of_the_tcp_begins_at_the_table_by_default():
    assert np.array_equal(WorkspaceConfig(table_z=-0.02).lower(), [0.25, -0.4, -0.02])


def test_a_real_hand_keeps_more_clearance_than_its_arms_tolerance_and_a_simulated_one_todays():
    assert WorkspaceConfig(table_z=0.0).clearance == 0.003 > POSITION_TOLERANCE
    with pytest.raises(ValueError, match="greater than 0.002"):
        WorkspaceConfig(table_z=0.0, clearance=0.002)
    assert SimulatedCellConfig().clearance == TABLE_CLEARANCE


def test_a_table_that_was_never_measured_names_the_program_that_measures_it():
    with pytest.raises(ValueError, match=r"run hal\.touch"):
        WorkspaceConfig.model_validate({"table_z": None})


def test_an_error_of_a_table_moves_its_points_as_it_says():
    centre = np.array([0.5, 0.0])
    motion = TableError(height=0.003, slope=(0.01, -0.005)).motion(centre, 0.1)
    assert motion.apply(np.array([0.5, 0.0, 0.1])) == pytest.approx([0.5, 0.0, 0.103])
    for x, y in ((0.6, 0.1), (0.4, -0.1)):
        moved = motion.apply(np.array([x, y, 0.1]))
        rise = 0.01 * (moved[0] - 0.5) - 0.005 * moved[1]
        assert moved[2] == pytest.approx(0.103 + rise, abs=1e-9) and moved[:2] == pytest.approx(
            [x, y], abs=1e-4
        )


@pytest.mark.parametrize("values", [{"height": 0.01}, {"slope": (0.1, 0.0)}])
def test_an_error_of_a_table_is_small(values: dict):
    with pytest.raises(ValueError, match="0.005|0.02"):
        TableError(**values)


def test_the_reach_of_a_box_is_its_farthest_corner_seen_from_above():
    assert WorkspaceConfig(table_z=0.0).reach() == pytest.approx(0.85)
    box = WorkspaceConfig(table_z=0.0, box_lower=(0.3, -0.6, 0.0), box_upper=(0.8, 0.2, 0.7))
    assert box.reach() == pytest.approx(1.0)
