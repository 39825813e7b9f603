"""Contract of every camera."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from hal import Cell, SensorNoise, cell_from_yaml
from hal.mujoco import MujocoCellConfig, mujoco_cell
from hal.replay import RecordingWriter, ReplayCamera, ReplayCameraConfig
from hal.replay.recorder import RecordingCamera
from hal.sim import SapienCamera
from hal.testing import CameraContract, Station
from tests.hal.kinect2.bench import Bench
from tests.hal_contract.conftest import CELLS


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
                make = partial(Bench(Path(folder), patch).camera, colour_scale=3)
                with make() as camera:
                    yield Station(camera, table, make)


class TestCamera(CameraContract):
    depth_range = (0.6, 4.5)  # the arm at home is out of sight, too

    def test_a_camera_can_be_opened_again(self, station: Station):
        if isinstance(station.camera, SapienCamera):
            return  # test_a_cell_can_be_opened_again does it with the whole cell, which is slow to build
        super().test_a_camera_can_be_opened_again(station)
