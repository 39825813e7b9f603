"""The overhead camera: where points of the table appear, and how much of it is seen."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from mskgrasp.core.settings import REGION, Overhead


def pixel(camera: Overhead, point_base: tuple[float, float, float]) -> np.ndarray:
    """Column and row of a point, by a camera whose middle is over (0.5, 0.1)."""
    seen = camera.intrinsics() @ camera.T_base_camera((0.5, 0.1)).inverse().apply(np.array(point_base))
    return seen[:2] / seen[2]


def test_the_middle_is_seen_in_the_middle_from_every_height():
    camera = Overhead(height=0.7, n_pixels=100)
    for z in (0.0, 0.1, 0.5):
        assert pixel(camera, (0.5, 0.1, z)) == pytest.approx([49.5, 49.5], abs=1e-9)


def test_away_from_the_base_is_up_and_to_its_left_is_left():
    """Similar triangles by hand: 10 mm at 0.5 m below a camera of 400 pixels are 8 pixels."""
    camera = Overhead(height=0.8, focal_px=400.0, n_pixels=161)
    assert pixel(camera, (0.51, 0.1, 0.3)) == pytest.approx([80, 72])
    assert pixel(camera, (0.5, 0.11, 0.3)) == pytest.approx([72, 80])


def test_the_optical_frame_is_right_handed_and_looks_down():
    pose = Overhead().T_base_camera((0.5, 0.0)).as_matrix()
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
    assert pose[:3, 2] == pytest.approx([0, 0, -1]) and pose[:3, 3] == pytest.approx([0.5, 0, 0.8])


def test_the_default_camera_sees_35_cm_and_so_the_whole_region():
    camera = Overhead()
    camera.check_sees(REGION)
    camera.check_sees((0.0, 0.35, 0.0, 0.35))  # 160 pixels of 0.8 m / 365.5
    with pytest.raises(ValueError, match="sees 0.35 m of the table, less than the region"):
        camera.check_sees((0.0, 0.351, 0.0, 0.1))


@pytest.mark.parametrize("region", [(0.5, 0.5, 0.0, 0.1), (0.4, 0.5, 0.1, 0.0), (0.4, float("nan"), 0, 1)])
def test_an_empty_region_is_refused(region: tuple[float, float, float, float]):
    with pytest.raises(ValueError, match="x_min < x_max, y_min < y_max"):
        Overhead().check_sees(region)


@pytest.mark.parametrize(
    "values", [dict(height=0.3), dict(focal_px=0), dict(n_pixels=31), dict(n_pixels=425)]
)
def test_a_camera_that_cannot_be_is_refused(values: dict[str, float]):
    with pytest.raises(ValidationError):
        Overhead.model_validate(values)
