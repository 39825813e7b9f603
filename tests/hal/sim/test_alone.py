"""The rendered camera of a cell whose arm is elsewhere."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from hal import SensorNoise
from hal.config import READY
from hal.sim.alone import sapien_camera
from hal.sim.camera import SapienCamera
from hal.sim.config import SapienCameraConfig
from hal.sim.world import SapienWorld
from mskgrasp.parts import Part

REGION = (0.33, 0.57, -0.15, 0.09)


@pytest.fixture(scope="module")
def alone(block: Part) -> Iterator[tuple[SapienCamera, SapienWorld]]:
    config = SapienCameraConfig(
        driver="sapien", part=str(block.folder), seed=3, noise=SensorNoise(model="iid")
    )
    camera, world = sapien_camera(config, region=REGION, home=np.array(READY))
    with camera:
        yield camera, world


def test_the_camera_hangs_over_the_middle_of_the_region_and_sees_the_part_there(alone):
    camera, world = alone
    frame = camera.capture()
    assert frame.T_base_camera.position == pytest.approx([0.45, -0.03, 0.8])
    x, y, _ = world.part_pose().position
    assert REGION[0] <= x <= REGION[1] and REGION[2] <= y <= REGION[3]
    u, v, w = frame.intrinsics @ frame.T_base_camera.inverse().apply(world.part_pose().position)
    row, column = round(v / w), round(u / w)
    patch = frame.depth[row - 2 : row + 3, column - 2 : column + 3]
    top = 0.8 - world.top()
    # Twenty-five pixels of noise of 3 mm have a mean good to 0.6 mm; the table is at least 2 cm farther.
    assert np.mean(patch) == pytest.approx(top, abs=3e-3) and top < 0.78 + 1e-6


def test_its_noise_is_the_configured_one_and_begins_anew_with_every_part(alone, block: Part):
    camera, world = alone
    frames = []
    for _ in range(2):
        world.present(str(block.folder), 5)
        frames.append([camera.capture().depth for _ in range(2)])
    first, second = frames
    assert np.array_equal(first[0], second[0], equal_nan=True)
    assert np.array_equal(first[1], second[1], equal_nan=True)
    # Two frames of the same table differ by twice the variance of 3 mm.
    difference = (first[0] - first[1])[:40, :40]
    assert np.std(difference) == pytest.approx(3e-3 * np.sqrt(2), rel=0.06)


def test_a_region_larger_than_the_image_is_refused_before_anything_is_built():
    with pytest.raises(ValueError, match=r"the camera sees 0.35 m of the table, less than the region"):
        sapien_camera(SapienCameraConfig(driver="sapien"), region=(0.3, 0.7, -0.1, 0.1), home=np.array(READY))
