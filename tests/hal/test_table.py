"""The plane of the table, in images of planes that are known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hal import RgbdFrame
from hal.table import fit_table
from mskgrasp.core.geometry import Pose, quat_about_z
from tests.hal.flat_table import DOWN, WORKSPACE, frame_of_table


def plane_of(frame: RgbdFrame, region: tuple[float, float, float, float] = WORKSPACE.region):
    return fit_table(frame.depth, frame.intrinsics, frame.T_base_camera, region, 0.0)


@pytest.mark.parametrize("part", [False, True])
@pytest.mark.parametrize(("z", "slope"), [(0.0, 0.0), (0.012, 0.0), (-0.024, 0.02)])
def test_the_tables_height_and_tilt_are_found_with_a_part_on_it(z: float, slope: float, part: bool):
    plane = plane_of(frame_of_table(z, slope, part))
    assert plane is not None
    assert plane.z == pytest.approx(z, abs=1e-4)
    assert plane.tilt_rad == pytest.approx(np.arctan(slope), abs=1e-3)


@pytest.mark.parametrize("along", ["x", "y"])
def test_the_height_is_that_in_the_middle_of_the_region_and_the_slope_is_along_the_bases_axes(along: str):
    """A table that rises by 20 mm a metre, 12 mm high under the camera."""
    middle, turn = Pose(position=np.array([0.5, 0.0, 0.0]), quat_wxyz=np.array([1.0, 0, 0, 0])), np.pi / 2
    quarter = middle @ Pose(position=np.zeros(3), quat_wxyz=quat_about_z(np.array(turn))) @ middle.inverse()
    frame = frame_of_table(0.012, 0.02, pose=DOWN if along == "x" else quarter @ DOWN)
    plane = plane_of(frame, (0.42, 0.62, -0.1, 0.04))
    assert plane is not None
    assert plane.slope == pytest.approx((0.02, 0.0) if along == "x" else (0.0, 0.02), abs=1e-4)
    assert plane.z == pytest.approx(0.012 + 0.02 * (0.02 if along == "x" else -0.03), abs=1e-5)


def test_noise_and_the_shares_of_depth_and_of_table_are_measured():
    frame = frame_of_table(0.012, 0.02, part=True)
    frame.depth[:] += np.random.default_rng(0).normal(0, 5e-4, frame.depth.shape)
    frame.depth[:, :80] = np.nan
    plane = plane_of(frame)
    assert plane is not None
    assert plane.noise == pytest.approx(5e-4, rel=0.05)
    assert plane.valid == pytest.approx(0.5, abs=0.01)
    # Of the 110 x 55 pixels of the region with a depth, the part covers 50 x 20.
    assert plane.share == pytest.approx(1 - 50 * 20 / (110 * 55), abs=0.01)


def test_an_image_without_depth_has_no_table():
    frame = frame_of_table()
    assert plane_of(dataclasses.replace(frame, depth=np.full_like(frame.depth, np.nan))) is None
