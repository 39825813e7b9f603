"""Settings that all simulated cells share, and those of a table."""

from __future__ import annotations

import numpy as np
import pytest

from hal.config import READY, SimulatedCellConfig, WorkspaceConfig


def test_simulated_and_real_cells_have_the_same_home():
    assert SimulatedCellConfig().home == WorkspaceConfig(table_z=0.0).home == READY


@pytest.mark.parametrize(
    ("region", "message"),
    [((0.5, 0.74, 0.3, 0.54), "reaches beyond the arm"), ((0.2, 0.8, -0.3, 0.3), "the camera sees 0.35 m")],
)
def test_a_region_that_arm_or_camera_cannot_use_is_refused(
    region: tuple[float, float, float, float], message: str
):
    with pytest.raises(ValueError, match=message):
        SimulatedCellConfig(region=region)


def test_the_box_of_the_tcp_begins_at_the_table_by_default():
    assert np.array_equal(WorkspaceConfig(table_z=-0.02).lower(), [0.25, -0.4, -0.02])
