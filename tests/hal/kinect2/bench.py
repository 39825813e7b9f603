"""A Kinect that is not there: the fake driver's control file, and a camera that talks to it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hal.camera_calibration import Calibration, write_calibration
from hal.charuco import Board
from hal.kinect2 import Kinect2Camera, Kinect2Config
from mskgrasp.core.geometry import Pose

FAKE = Path(__file__).parent / "fake"
SERIAL = "000583142247"
BUSY_S = 20.0
"""A busy machine may take this much longer."""
# The optical frame over the table's middle: the image's top is away from the base, z down.
OVERHEAD = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


class Bench:
    """What is plugged in, and what goes wrong.

    Args:
        folder: For the control file and the calibration.
        monkeypatch: Sets the driver's environment.
    """

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch):
        self._control = folder / "kinect.json"
        self.calibration = folder / "calibration.yaml"
        monkeypatch.setenv("FAKE_KINECT2", str(self._control))
        monkeypatch.setenv("PYTHONPATH", str(FAKE))
        self.set()
        self.calibrate()

    def show_board(self, board: Board, T_camera_board: Pose) -> None:
        """Show a calibration board with a white edge of a centimetre."""
        margin, path = 0.01, self._control.with_name("board.npy")
        if not path.is_file():
            np.save(path, board.image(60, margin))
        size = [edge + 2 * margin for edge in board.size]
        held = dict(T=T_camera_board.as_matrix().tolist(), size=size, texture=str(path))
        self.set(plates=[held])

    def show_plates(
        self, *plates: tuple[float, float, float, float, float, int | None], **values: Any
    ) -> None:
        """Show level plates: x, y of the middle, width along x, length along y, z (base frame), and grey."""
        shown = []
        for x, y, width, length, z, grey in plates:
            T_base_plate = Pose(position=np.array([x, y, z]), quat_wxyz=_overhead().quat_wxyz)
            pose = _overhead().inverse() @ T_base_plate
            shown.append(dict(T=pose.as_matrix().tolist(), size=[length, width], grey=grey))
        self.set(plates=shown, **values)

    def set(self, **values: Any) -> None:
        """Tells the fake driver what happens from now on."""
        text = json.dumps({"serials": [SERIAL]} | values)
        unfinished = self._control.with_suffix(".tmp")
        unfinished.write_text(text, encoding="utf-8")
        unfinished.replace(self._control)

    def calibrate(
        self, serial: str = SERIAL, intrinsics: np.ndarray | None = None, n_poses: int = 20
    ) -> None:
        """Writes the calibration file: 0.8 m over the middle of the usual region."""
        calibration = Calibration(
            serial=serial,
            T_base_camera=_overhead(),
            intrinsics=intrinsics,
            rms_translation_m=0.001,
            rms_rotation_rad=0.001,
            n_poses=n_poses,
            made="2026-10-01T12:00:00",
        )
        write_calibration(self.calibration, calibration)

    def camera(self, **settings: Any) -> Kinect2Camera:
        """A camera, not connected; quiet about warming up, and patient with a busy machine.

        What it measures too far is corrected; a frame is one exposure, without the fine colour, which takes
        longer than all else.
        """
        values: dict[str, Any] = dict(
            driver="kinect2",
            serial=SERIAL,
            calibration=self.calibration,
            depth_offset=-0.024,
            exposures=1,
            colour_scale=1,
            warm_up_s=0,
            connect_timeout_s=60,
            latency_s=0.4,
        )
        return Kinect2Camera(Kinect2Config(**(values | settings)))


def _overhead() -> Pose:
    """``T_base_camera``: 0.8 m over the middle of the usual region."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = OVERHEAD, (0.5, 0.0, 0.8)
    return Pose.from_matrix(matrix)
