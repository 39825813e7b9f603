"""The abstract camera: a camera of one's own needs to connect, disconnect and capture, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from hal.camera import Camera, RgbdFrame
from mskgrasp.core.geometry import Pose


def frame() -> RgbdFrame:
    return RgbdFrame(
        colour=np.zeros((2, 3, 3), np.uint8),
        depth=np.full((2, 3), 0.7, np.float32),
        intrinsics=np.eye(3),
        T_base_camera=Pose(position=np.zeros(3), quat_wxyz=np.array([1.0, 0, 0, 0])),
        timestamp_s=1.0,
        serial="one",
    )


def test_a_camera_that_cannot_capture_is_refused_before_it_is_connected():
    abstract = Camera.__abstractmethods__
    assert "capture" in abstract
    without = type("Blind", (Camera,), {name: lambda self: None for name in abstract - {"capture"}})
    with pytest.raises(TypeError, match="capture"):
        without()


def test_what_is_abstract_is_all_that_a_camera_needs():
    own = {name: lambda self: None for name in Camera.__abstractmethods__}
    camera = type("Own", (Camera,), own | {"capture": lambda self, timeout_s=5.0: frame()})()
    with camera:
        assert camera.capture().depth.shape == (2, 3)


def test_a_frame_has_neither_fine_colour_nor_infrared_unless_the_camera_gives_them():
    assert frame().fine_colour is None and frame().infrared is None


def test_a_frame_is_one_exposure_from_a_calibrated_pose_unless_the_camera_says_otherwise():
    own = {name: lambda self: None for name in Camera.__abstractmethods__}
    camera = type("Own", (Camera,), own)()
    assert (camera.exposures, camera.by_hand) == (1, False)
