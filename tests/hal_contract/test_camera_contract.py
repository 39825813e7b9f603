"""What every camera promises."""

from __future__ import annotations

import time

import numpy as np
import pytest

from hal import Cell, cell_from_yaml
from hal.errors import NotConnected
from tests.hal_contract.conftest import CELLS


def test_a_frame_has_colour_depth_intrinsics_pose_time_and_serial(cell: Cell):
    before = time.monotonic()
    frame = cell.camera.capture()
    h, w = frame.depth.shape
    assert frame.colour.shape == (h, w, 3) and frame.colour.dtype == np.uint8
    assert frame.depth.dtype == np.float32
    assert frame.intrinsics.shape == (3, 3) and frame.intrinsics[2].tolist() == [0, 0, 1]
    assert before <= frame.timestamp_s <= time.monotonic()
    assert frame.serial


def test_depth_is_metres_and_the_table_is_where_the_cell_says(cell: Cell):
    frame = cell.camera.capture()
    rows, columns = np.mgrid[0 : frame.depth.shape[0], 0 : frame.depth.shape[1]]
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(frame.intrinsics).T
    points_base = frame.T_base_camera.apply(rays * frame.depth[..., None])
    x_min, x_max, y_min, y_max = cell.workspace.region
    inside = (points_base[..., 0] > x_min) & (points_base[..., 0] < x_max)
    inside &= (points_base[..., 1] > y_min) & (points_base[..., 1] < y_max)
    assert inside.sum() > 2000
    assert np.median(points_base[inside][:, 2]) == pytest.approx(cell.workspace.table_z, abs=2e-3)


def test_the_arm_at_home_is_out_of_sight(cell: Cell):
    depth = cell.camera.capture().depth
    assert np.nanmin(depth) > 0.6


def test_a_new_frame_is_later_than_the_one_before(cell: Cell):
    first, second = cell.camera.capture(), cell.camera.capture()
    assert second.timestamp_s > first.timestamp_s
    assert first.depth is not second.depth


def test_a_camera_outside_its_context_refuses():
    camera = cell_from_yaml(CELLS / "sapien.yaml").camera
    with pytest.raises(NotConnected, match="not connected"):
        camera.capture()
    camera.close()
    camera.close()
