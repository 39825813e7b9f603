"""Configuration of a hand-eye calibration."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from pydantic import Field

from hal.calibrate.hand_eye import MIN_VIEWS
from hal.charuco import Board
from mskgrasp.core.config import Config
from mskgrasp.core.geometry import Pose


class CalibrateConfig(Config):
    """Settings of one calibration."""

    cell: Path | None = None
    """YAML file of the cell, for example configs/cells/panda_kinect2.yaml."""
    out: Path = Path("out/calibration")
    """Folder for the calibration and the pictures; one calibration, one folder."""
    source: Annotated[Path | None, tyro.conf.arg(name="from")] = None
    """Solve again from the pictures in this folder; no arm and no camera is needed."""
    print_board: Path | None = None
    """Only write the board for printing to this file, .pdf or .png, at its true size."""
    board: Board = Board()
    """The board, as it was printed and measured."""
    poses: int = Field(default=24, ge=MIN_VIEWS, le=200)
    """Pictures of the board to take."""
    tilt_deg: float = Field(default=30.0, ge=10, le=50)
    """Greatest tilt of the board against the camera's line of sight, degrees."""
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
    seed: int = Field(default=0, ge=0)
    """Determines the poses."""

    def T_tcp_board(self) -> Pose:
        """Approximate pose of the board in the hand."""
        half = np.radians(self.board_turn_deg) / 2
        return Pose(
            position=np.array(self.board_at), quat_wxyz=np.array([np.cos(half), 0.0, 0.0, np.sin(half)])
        )
