"""The contract of cameras fails for a camera that breaks it; those that pass are in tests/hal_contract."""

from __future__ import annotations

import pytest

from hal.testing import CameraContract, Station
from tests.hal.replay.toy import ToyCamera, toy_cell


def station(camera: ToyCamera) -> Station:
    return Station(camera, toy_cell().workspace, ToyCamera)


def test_a_frame_of_the_right_shapes_passes():
    CameraContract().test_a_frame_has_colour_depth_intrinsics_pose_time_and_serial(station(ToyCamera()))


def test_a_camera_that_sees_no_table_fails():
    with pytest.raises(AssertionError):
        CameraContract().test_depth_is_metres_and_the_table_is_where_the_cell_says(station(ToyCamera()))


def test_a_camera_that_captures_outside_its_context_fails():
    with pytest.raises(pytest.fail.Exception, match="DID NOT RAISE"):
        CameraContract().test_a_camera_outside_its_context_refuses(station(ToyCamera()))
