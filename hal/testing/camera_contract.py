"""Contract of every depth camera over a cell's table."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from hal.camera import Camera
from hal.cell import Workspace
from hal.errors import NotConnected


@dataclass(frozen=True)
class Station:
    """A connected camera over a table, and another one.

    Attributes:
        camera: Connected.
        workspace: The table, of which it sees the region; parts cover less than half of that.
        another: Builds a camera of the kind that is not connected.
    """

    camera: Camera
    workspace: Workspace
    another: Callable[[], Camera]


class CameraContract:
    """Checks of a camera. A subclass, or its module, has a fixture ``station``, a `Station`.

    Attributes:
        depth_range: All valid depths are between, metres.
    """

    depth_range = (0.1, 10.0)

    def test_a_frame_has_colour_depth_intrinsics_pose_time_and_serial(self, station: Station):
        before = time.monotonic()
        frame = station.camera.capture()
        h, w = frame.depth.shape
        assert frame.colour.shape == (h, w, 3) and frame.colour.dtype == np.uint8
        assert frame.depth.dtype == np.float32
        assert frame.intrinsics.shape == (3, 3) and frame.intrinsics[2].tolist() == [0, 0, 1]
        assert before <= frame.timestamp_s <= time.monotonic()
        assert frame.serial

    def test_depth_is_metres_and_the_table_is_where_the_cell_says(self, station: Station):
        frame = station.camera.capture()
        rows, columns = np.mgrid[0 : frame.depth.shape[0], 0 : frame.depth.shape[1]]
        rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(frame.intrinsics).T
        points_base = frame.T_base_camera.apply(rays * frame.depth[..., None])
        x_min, x_max, y_min, y_max = station.workspace.region
        inside = (points_base[..., 0] > x_min) & (points_base[..., 0] < x_max)
        inside &= (points_base[..., 1] > y_min) & (points_base[..., 1] < y_max)
        assert inside.sum() > 2000
        assert np.median(points_base[inside][:, 2]) == pytest.approx(station.workspace.table_z, abs=2e-3)

    def test_what_is_not_measured_is_nan_and_all_else_is_a_sensible_depth(self, station: Station):
        depth = station.camera.capture().depth
        valid = np.isfinite(depth)
        assert not np.isinf(depth).any() and valid.mean() > 0.5
        nearest, farthest = self.depth_range
        assert depth[valid].min() > nearest and depth[valid].max() < farthest

    def test_a_new_frame_is_later_than_the_one_before_and_shares_nothing_with_it(self, station: Station):
        first = station.camera.capture()
        kept = first.depth.copy()
        second = station.camera.capture()
        assert second.timestamp_s > first.timestamp_s and second.serial == first.serial
        second.depth[:] = 0
        second.colour[:] = 0
        second.intrinsics[:] = 0
        assert np.array_equal(first.depth, kept, equal_nan=True)
        second.T_base_camera.position[:] = 0
        third = station.camera.capture()
        assert (
            third.intrinsics[0, 0] > 0 and np.nanmax(third.depth) > 0 and third.T_base_camera.position[2] > 0
        )

    def test_connecting_twice_is_connecting_once(self, station: Station):
        station.camera.connect()
        assert station.camera.capture().serial

    def test_a_camera_outside_its_context_refuses(self, station: Station):
        camera = station.another()
        with pytest.raises(NotConnected, match="not connected"):
            camera.capture()
        camera.close()
        camera.close()

    def test_a_camera_can_be_opened_again(self, station: Station):
        camera = station.another()
        for _ in range(2):
            with camera:
                assert camera.capture().depth.size
            with pytest.raises(NotConnected):
                camera.capture()
