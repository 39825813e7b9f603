"""The plane of the table, in images of planes that are known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hal import RgbdFrame
from hal.table import fit_table
from tests.hal.flat_table import WORKSPACE, frame_of_table


def plane_of(frame: RgbdFrame):
    return fit_table(frame.depth, frame.intrinsics, frame.T_base_camera, WORKSPACE.region, 0.0)


@pytest.mark.parametrize("part", [False, True])
@pytest.mark.parametrize(("z", "slope"), [(0.0, 0.0), (0.012, 0.0), (-0.024, 0.02)])
def test_the_tables_height_and_tilt_are_found_with_a_part_on_it(z: float, slope: float, part: bool):
    plane = plane_of(frame_of_table(z, slope, part))
    assert plane is not None
    assert plane.z == pytest.approx(z, abs=1e-4)
    assert plane.tilt_rad == pytest.approx(np.arctan(slope), abs=1e-3)


def test_an_image_without_depth_has_no_table():
    frame = frame_of_table()
    assert plane_of(dataclasses.replace(frame, depth=np.full_like(frame.depth, np.nan))) is None
