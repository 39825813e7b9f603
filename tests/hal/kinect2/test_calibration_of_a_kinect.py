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
from hal.calibrate.report import depth_offset
from hal.charuco import Board, detect, infrared_grey
from hal.kinect2 import Kinect2Camera
from mskgrasp.core.geometry import Pose, quat_about_z
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
        with bench.camera(depth_offset=0.0, colour_scale=3) as camera:
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


def on_colour(pictures: list[Picture]) -> HandEye:
    views = [dataclasses.replace(picture, infrared=None).view(BOARD) for picture in pictures]
    return solve_hand_eye(BOARD, views)


@pytest.mark.slow
def test_on_colour_registered_with_depth_that_is_too_far_the_camera_is_displaced_along_rows(
    pictures: list[Picture],
):
    found = on_colour(pictures)
    along_rows = shift_on_the_table(found)[0]
    assert 1e-3 < abs(along_rows) < 3e-3
    assert found.half_translation_m < 0.5 * abs(along_rows)  # in both halves alike: `repeatable` is silent


@pytest.mark.slow
def test_on_infrared_the_camera_is_where_it_is_whatever_depth_measures(pictures: list[Picture]):
    found = solve_hand_eye(BOARD, [picture.view(BOARD) for picture in pictures])
    assert np.abs(shift_on_the_table(found)).max() < 0.3e-3
    offset = depth_offset(BOARD, pictures, found)
    assert offset is not None and offset.metres == pytest.approx(0.024, abs=0.5e-3)


@pytest.mark.parametrize(("depth_offset", "along_rows_px"), [(0.0, 0.80), (-0.024, 0.0)])
def test_colour_is_registered_with_the_corrected_depth(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, depth_offset: float, along_rows_px: float
):
    """A board at 0.75 m: 1081 px * 52 mm * (1 / 750 - 1 / 774) / 2.92 colour pixels for one of depth."""
    bench = Bench(tmp_path, monkeypatch)
    bench.show_board(
        BOARD, Pose(position=np.array([0.05, -0.03, 0.75]), quat_wxyz=quat_about_z(np.array(0.3)))
    )
    with bench.camera(depth_offset=depth_offset, colour_scale=3) as camera:
        frame = camera.capture(30.0)
    assert frame.infrared is not None and frame.fine_colour is not None
    true = detect(BOARD, infrared_grey(frame.infrared))
    for image, scale in ((frame.colour, 1), (frame.fine_colour, 3)):
        found = detect(BOARD, image)
        both, of_found, of_true = np.intersect1d(found.ids, true.ids, return_indices=True)
        assert len(both) >= 10
        pixels = (found.pixels[of_found] + 0.5) / scale - 0.5
        off = np.median(pixels - true.pixels[of_true], axis=0)
        assert np.abs(off) == pytest.approx([along_rows_px, 0.0], abs=0.06)
