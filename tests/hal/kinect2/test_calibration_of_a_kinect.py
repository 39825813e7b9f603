"""Hand-eye calibration of a Kinect whose depth is too far, where the truth is known."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hal import Camera, Cell, RgbdFrame, Workspace
from hal.calibrate.board_views import Picture, take_pictures
from hal.calibrate.hand_eye import HandEye, solve_hand_eye
from hal.charuco import Board
from hal.kinect2 import Kinect2Camera
from mskgrasp.core.geometry import Pose
from tests.hal.kinect2.bench import OVERHEAD, Bench
from tests.hal.replay.toy import ToyArm

BOARD = Board()
HELD = Pose(position=np.array([0.16, 0.0, 0.0]), quat_wxyz=np.array([1.0, 0, 0, 0]))
TRUTH = Pose(
    position=np.array([0.5, 0.0, 0.8]),
    quat_wxyz=Rotation.from_matrix(OVERHEAD).as_quat(scalar_first=True),
)


class WatchingCamera(Camera):
    """A Kinect before which a toy arm holds the board."""

    def __init__(self, camera: Kinect2Camera, bench: Bench, arm: ToyArm):
        self._camera, self._bench, self._arm = camera, bench, arm

    def connect(self) -> None: ...
    def close(self) -> None: ...

    def capture(self, timeout_s: float = 5.0) -> RgbdFrame:
        self._bench.show_board(BOARD, TRUTH.inverse() @ self._arm.state().T_base_tcp @ HELD)
        return self._camera.capture(30.0)


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> list[Picture]:
    """Taken before anything is known of the depth's error."""
    kept: list[Picture] = []
    with pytest.MonkeyPatch.context() as patch:
        bench = Bench(Path(tmp_path_factory.mktemp("kinect")), patch)
        arm = ToyArm()
        arm.connect()
        arm.limits = dataclasses.replace(arm.limits, box_lower=np.array([-1.0, -1.0, 0.06]))
        table = Workspace(
            table_z=0.0, region=(0.38, 0.62, -0.12, 0.12), home=np.zeros(7), min_height=0.006,
            lift_height=0.1, grasp_force=20.0,
        )  # fmt: skip
        with bench.camera(depth_offset=0.0) as camera:
            cell = Cell(camera=WatchingCamera(camera, bench, arm), arm=arm, workspace=table)
            take_pictures(
                cell, BOARD, HELD, n=16, tilt_rad=np.radians(30), nearest=0.5, speed=0.2, settle_s=0.0,
                rng=np.random.default_rng(0), keep=lambda _, picture, __: kept.append(picture),
            )  # fmt: skip
    return kept


def shift_on_the_table(found: HandEye) -> np.ndarray:
    """(3,) metres in the true camera's axes by which a point of the table in its middle is misplaced."""
    seen = np.array([0.0, 0.0, 0.8])
    return TRUTH.inverse().apply(found.T_base_camera.apply(seen)) - seen


def test_colour_registered_with_depth_that_is_too_far_displaces_the_camera_along_rows(
    pictures: list[Picture],
):
    found = solve_hand_eye(BOARD, [picture.view(BOARD) for picture in pictures])
    assert 1e-3 < abs(shift_on_the_table(found)[0]) < 3e-3
    assert found.half_translation_m < 0.5 * abs(shift_on_the_table(found)[0])  # in both halves alike
