"""Configuration of a hand-eye calibration."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from pydantic import Field, model_validator
from scipy.spatial.transform import Rotation

from hal.calibrate.hand_eye import MIN_VIEWS
from hal.charuco import Board
from mskgrasp.core.config import Config
from mskgrasp.core.geometry import Pose

_LEAST_DOWN = 0.5
"""Least downward part of the camera's line of sight, as `hal.doctor` requires it."""


class CalibrateConfig(Config):
    """Settings of one calibration."""

    cell: Path | None = None
    """YAML file of the cell, for example configs/cells/panda_kinect2.yaml."""
    out: Path | None = None
    """Folder for the calibration and the pictures; one calibration, one folder. By default that of --from,
    without it out/calibration."""
    source: Annotated[Path | None, tyro.conf.arg(name="from")] = None
    """Solve again from the pictures in this folder; no arm and no camera is needed."""
    print_board: Path | None = None
    """Only write the board for printing to this file, .pdf or .png, at its true size."""
    board: Board = Board()
    """The board, as it was printed and measured."""
    poses: int = Field(default=24, ge=MIN_VIEWS, le=200)
    """Pictures of the board to take."""
    tilt_deg: float = Field(default=30.0, ge=25, le=50)
    """Greatest tilt of the board against the camera's line of sight, degrees; with less than 25, 8 pictures
    may not determine the camera."""
    board_at: tuple[float, float, float] = (0.16, 0.0, 0.0)
    """Middle of the board in the tcp frame, m, to 1 cm: x across the thin side of the hand, z out of it."""
    board_turn_deg: float = Field(default=0.0, ge=-180, le=180)
    """Turn of the board about the hand's axis; 0: x as printed is the hand's x, print to the wrist."""
    nearest: float = Field(default=0.5, ge=0.2, le=2)
    """The board stays at least this far from the camera, m; a Kinect v2 sees nothing nearer than 0.5 m."""
    speed: float = Field(default=0.1, gt=0, le=0.5)
    """Speed of the hand, m/s; the cell file may allow less."""
    settle_s: float = Field(default=0.5, ge=0, le=10)
    """Rest before each picture, s."""
    camera_at: tuple[float, float, float] | None = None
    """Position of the camera measured by tape, base frame, m; required before a first calibration."""
    camera_towards: tuple[float, float, float] | None = None
    """With --camera-at: the point in the middle of its image, base frame, m; by default straight below it."""
    camera_turn_deg: float = Field(default=0.0, ge=-180, le=180)
    """With --camera-at: turn of the camera about its line of sight, clockwise as it sees; 0: top of its image
    away from the base, 180: towards the base."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Determines the poses."""

    @model_validator(mode="after")
    def _check(self) -> CalibrateConfig:
        if self.print_board is not None and self.source is not None:
            raise ValueError("--print-board and --from exclude each other; omit one")
        if self.camera_at is None:
            if self.camera_towards is not None or self.camera_turn_deg:
                raise ValueError(
                    "camera_towards and camera_turn_deg are of a camera measured by hand; give camera_at, too"
                )
        elif (down := self._line_of_sight()[2]) > -_LEAST_DOWN:
            least, angle = np.degrees(np.arcsin([_LEAST_DOWN, 0.0 - down]))
            raise ValueError(
                f"camera_towards {list(self.camera_towards or [])} is {angle:.0f} degrees below the horizon "
                f"of a camera at {list(self.camera_at)}, at least {least:.0f} are needed to see the table"
            )
        return self

    @property
    def folder(self) -> Path:
        """``out``, or what it is by default."""
        return self.out or self.source or Path("out/calibration")

    def T_base_camera(self) -> Pose:
        """Pose of the camera measured by hand.

        Raises:
            ValueError: ``camera_at`` is not set.
        """
        if self.camera_at is None:
            raise ValueError("camera_at is not set")
        z = self._line_of_sight()
        up = np.array([1.0, 0.0, 0.0])
        y = -(up - (up @ z) * z)
        y /= np.linalg.norm(y)
        upright = Rotation.from_matrix(np.stack([np.cross(y, z), y, z], axis=1))
        turned = upright * Rotation.from_euler("z", self.camera_turn_deg, degrees=True)
        return Pose(position=np.array(self.camera_at), quat_wxyz=turned.as_quat(scalar_first=True))

    def _line_of_sight(self) -> np.ndarray:
        """(3,) unit vector, base frame."""
        if self.camera_towards is None:
            return np.array([0.0, 0.0, -1.0])
        ray = np.array(self.camera_towards) - np.array(self.camera_at)
        length = float(np.linalg.norm(ray))
        return ray / length if length > 0 else ray

    def T_tcp_board(self) -> Pose:
        """Approximate pose of the board in the hand."""
        half = np.radians(self.board_turn_deg) / 2
        return Pose(
            position=np.array(self.board_at), quat_wxyz=np.array([np.cos(half), 0.0, 0.0, np.sin(half)])
        )
