"""A cell opens both its devices or none."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hal import Cell
from hal.errors import NotConnected
from mskgrasp.core.grasp import lowest_grasp_z, pose_base_tcp
from tests.hal.flat_table import WORKSPACE
from tests.hal.test_device import Lamp


@pytest.mark.parametrize("broken", ["camera", "arm"])
def test_a_cell_that_opens_by_half_is_closed_again(broken: str):
    lamps = {name: Lamp(broken=name == broken) for name in ("camera", "arm")}
    workspace = SimpleNamespace()
    cell = Cell(**lamps, workspace=workspace)  # type: ignore[arg-type]
    with pytest.raises(NotConnected), cell.connected():
        pytest.fail("the block ran")
    assert not any(lamp.lit for lamp in lamps.values())
    assert lamps["camera"].log == (["connect"] if broken == "camera" else ["connect", "close"])
    assert lamps["arm"].log == ([] if broken == "camera" else ["connect"])


def test_the_lowest_grasp_of_a_level_table_is_to_the_bit_what_it_is_in_a_dataset():
    xy = np.random.default_rng(0).uniform(-1, 1, (50, 2))
    for table_z in (0.0, 0.1, -0.0137):
        workspace = replace(WORKSPACE, table_z=table_z)
        assert (workspace.lowest_grasp_z(xy) == lowest_grasp_z(table_z)).all()


def test_the_lowest_grasp_over_a_slope_keeps_every_corner_of_the_pads_clear():
    workspace = replace(WORKSPACE, clearance=0.003, table_slope=(0.01, -0.02))
    for x, y, theta in np.random.default_rng(0).uniform([0.4, -0.1, -1.5], [0.6, 0.1, 1.5], (20, 3)):
        z = float(workspace.lowest_grasp_z(np.array([x, y])))
        corners = pose_base_tcp(np.array([x, y, z, theta])).apply(
            np.array([[a * 0.011, b * 0.056, 0.0095] for a in (-1, 1) for b in (-1, 1)])
        )
        table = 0.01 * (corners[:, 0] - 0.5) - 0.02 * corners[:, 1]
        assert 0.003 <= (corners[:, 2] - table).min() < 0.006


def test_the_pads_keep_their_clearance_and_on_a_slope_what_their_corners_need():
    sloping = replace(WORKSPACE, clearance=0.003, table_slope=(0.0, 0.02))
    level = replace(sloping, table_slope=(0.0, 0.0))
    assert level.pads_clearance == 0.003
    rise = sloping.lowest_grasp_z(sloping.centre) - level.lowest_grasp_z(level.centre)
    assert rise == pytest.approx(sloping.pads_clearance - 0.003)
    # A corner of the pads is 57 mm from the middle of the hand.
    assert rise == pytest.approx(0.02 * 0.057, abs=3e-5)
