"""Contract of every camera."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from hal import Camera, Cell, SensorNoise, Workspace, cell_from_yaml
from hal.errors import NotConnected
from hal.mujoco import MujocoCellConfig, mujoco_cell
from hal.replay import RecordingWriter, ReplayCamera, ReplayCameraConfig
from hal.replay.recorder import RecordingCamera
from hal.sim import SapienCamera
from tests.hal.kinect2.bench import Bench
from tests.hal_contract.conftest import CELLS


@dataclass(frozen=True)
class Station:
    """A connected camera over a table, and how to get another one that is not connected."""

    camera: Camera
    workspace: Workspace
    another: Callable[[], Camera]


@pytest.fixture(scope="module")
def sapien() -> Iterator[Cell]:
    """The simulated cell, its camera alone connected."""
    cell = cell_from_yaml(CELLS / "sapien.yaml")
    with cell.camera:
        yield cell


@pytest.fixture(
    scope="module", params=["sapien", "sapien with noise", "mujoco", "mujoco with noise", "replay", "kinect2"]
)
def station(
    request: pytest.FixtureRequest, sapien: Cell, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Station]:
    table, folder = sapien.workspace, tmp_path_factory.mktemp("camera")
    match request.param:
        case "sapien":
            yield Station(sapien.camera, table, lambda: cell_from_yaml(CELLS / "sapien.yaml").camera)
        case "sapien with noise":
            assert isinstance(sapien.camera, SapienCamera)
            world, noise = sapien.camera._world, SensorNoise(model="kinect2", offset=0.0)
            with SapienCamera(world, noise) as camera:
                yield Station(camera, table, lambda: SapienCamera(world, noise))
        case "mujoco":
            with cell_from_yaml(CELLS / "mujoco.yaml").camera as camera:
                yield Station(camera, table, lambda: cell_from_yaml(CELLS / "mujoco.yaml").camera)
        case "mujoco with noise":
            config = MujocoCellConfig(type="mujoco", noise=SensorNoise(model="kinect2", offset=0.0))
            with mujoco_cell(config).camera as camera:
                yield Station(camera, table, lambda: mujoco_cell(config).camera)
        case "replay":
            with RecordingCamera(sapien.camera, RecordingWriter(folder / "a.h5", table, sapien.arm)) as taken:
                for _ in range(3):
                    taken.capture()
            sapien.camera.connect()  # the recorder has released it
            config = ReplayCameraConfig(driver="replay", recording=folder / "a.h5", loop=True)
            with ReplayCamera(config) as camera:
                yield Station(camera, table, lambda: ReplayCamera(config))
        case _:
            with pytest.MonkeyPatch.context() as patch:
                bench = Bench(Path(folder), patch)
                with bench.camera() as camera:
                    yield Station(camera, table, bench.camera)


def test_a_frame_has_colour_depth_intrinsics_pose_time_and_serial(station: Station):
    before = time.monotonic()
    frame = station.camera.capture()
    h, w = frame.depth.shape
    assert frame.colour.shape == (h, w, 3) and frame.colour.dtype == np.uint8
    assert frame.depth.dtype == np.float32
    assert frame.intrinsics.shape == (3, 3) and frame.intrinsics[2].tolist() == [0, 0, 1]
    assert before <= frame.timestamp_s <= time.monotonic()
    assert frame.serial


def test_depth_is_metres_and_the_table_is_where_the_cell_says(station: Station):
    frame = station.camera.capture()
    rows, columns = np.mgrid[0 : frame.depth.shape[0], 0 : frame.depth.shape[1]]
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(frame.intrinsics).T
    points_base = frame.T_base_camera.apply(rays * frame.depth[..., None])
    x_min, x_max, y_min, y_max = station.workspace.region
    inside = (points_base[..., 0] > x_min) & (points_base[..., 0] < x_max)
    inside &= (points_base[..., 1] > y_min) & (points_base[..., 1] < y_max)
    assert inside.sum() > 2000
    assert np.median(points_base[inside][:, 2]) == pytest.approx(station.workspace.table_z, abs=2e-3)


def test_what_is_not_measured_is_nan_and_all_else_is_a_sensible_depth(station: Station):
    depth = station.camera.capture().depth
    valid = np.isfinite(depth)
    assert not np.isinf(depth).any() and valid.mean() > 0.5
    assert depth[valid].min() > 0.6 and depth[valid].max() < 4.5  # the arm at home is out of sight, too


def test_a_new_frame_is_later_than_the_one_before_and_shares_nothing_with_it(station: Station):
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
    assert third.intrinsics[0, 0] > 0 and np.nanmax(third.depth) > 0 and third.T_base_camera.position[2] > 0


def test_connecting_twice_is_connecting_once(station: Station):
    station.camera.connect()
    assert station.camera.capture().serial


def test_a_camera_outside_its_context_refuses(station: Station):
    camera = station.another()
    with pytest.raises(NotConnected, match="not connected"):
        camera.capture()
    camera.close()
    camera.close()


def test_a_camera_can_be_opened_again(station: Station):
    if isinstance(station.camera, SapienCamera):
        return  # test_a_cell_can_be_opened_again does it with the whole cell, which takes seconds to build
    camera = station.another()
    for _ in range(2):
        with camera:
            assert camera.capture().depth.size
        with pytest.raises(NotConnected):
            camera.capture()
