"""Calibration file of a camera, written by ``python -m hal.calibrate`` and read by the camera's driver."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import yaml
from pydantic import AfterValidator, Field

from mskgrasp.core.config import Config, check_config, read_yaml
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.files import write_whole
from mskgrasp.core.geometry import Pose

NORM_TOLERANCE = 1e-3
"""Greatest deviation of a quaternion's length from 1 in a file; more is a typing error, not rounding."""
_SCHEMA = 1


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Pose of a camera and its uncertainty.

    Attributes:
        serial: Serial number of the camera.
        T_base_camera: Pose of its optical frame (x right, y down, z forward) in the robot's base.
        intrinsics: (3, 3) pinhole matrix in pixels that overrides the factory's; None: the factory's.
        rms_translation_m: RMS residual between the poses of the board and the arm, metres.
        rms_rotation_rad: RMS residual of the rotations, radians.
        n_poses: Number of poses of the arm; 0: measured by hand, rough.
        made: Time of the calibration, ISO 8601.
    """

    serial: str
    T_base_camera: Pose
    intrinsics: np.ndarray | None
    rms_translation_m: float
    rms_rotation_rad: float
    n_poses: int
    made: str

    @property
    def by_hand(self) -> bool:
        """Whether the position was measured with a tape, not with a board."""
        return self.n_poses == 0


def _finite(values: tuple[float, ...]) -> tuple[float, ...]:
    if not np.isfinite(values).all():
        raise ValueError("must be finite numbers")
    return values


Row = Annotated[tuple[float, float, float], AfterValidator(_finite)]


class _PoseFields(Config):
    position_m: Row
    quat_wxyz: Annotated[tuple[float, float, float, float], AfterValidator(_finite)]


class _CalibrationFile(Config):
    """The file, field by field."""

    schema_version: int = Field(ge=_SCHEMA, le=_SCHEMA)
    serial: Annotated[str, Field(min_length=1)]
    T_base_camera: _PoseFields
    intrinsics: tuple[Row, Row, Row] | None
    rms_translation_m: float = Field(ge=0)
    rms_rotation_rad: float = Field(ge=0)
    n_poses: int = Field(ge=0)
    made: str


def write_calibration(path: Path, calibration: Calibration) -> None:
    """Write a calibration as YAML; the file appears whole or not at all."""
    pose, intrinsics = calibration.T_base_camera, calibration.intrinsics
    values = {
        "schema_version": _SCHEMA,
        "serial": calibration.serial,
        "T_base_camera": {
            "position_m": np.asarray(pose.position, dtype=np.float64).tolist(),
            "quat_wxyz": np.asarray(pose.quat_wxyz, dtype=np.float64).tolist(),
        },
        "intrinsics": None if intrinsics is None else np.asarray(intrinsics, dtype=np.float64).tolist(),
        "rms_translation_m": float(calibration.rms_translation_m),
        "rms_rotation_rad": float(calibration.rms_rotation_rad),
        "n_poses": int(calibration.n_poses),
        "made": calibration.made,
    }
    check_config(_CalibrationFile, values, f"calibration for {path}")
    text = (
        "# Pose of the camera's optical frame (x right, y down, z forward) in the robot's base.\n"
        "# Metres; quaternion w x y z. Made by python -m hal.calibrate.\n"
    ) + yaml.safe_dump(values, sort_keys=False, default_flow_style=None)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, text.encode())


def read_calibration(path: Path, *, serial: str | None) -> Calibration:
    """Read a calibration.

    Args:
        path: The file.
        serial: Serial number of the camera to use; None if not known yet. A position measured by
            hand is accepted for every camera.

    Raises:
        BadConfig: There is no such file, it is no calibration, or it is another camera's.
    """
    if not path.is_file():
        raise BadConfig(
            f"there is no calibration file {path}; make it with python -m hal.calibrate --cell FILE, or set "
            "camera.calibration to where it is"
        )
    file = check_config(_CalibrationFile, _quoted_serial(read_yaml(path), path), str(path))
    quat_wxyz = np.array(file.T_base_camera.quat_wxyz)
    norm = float(np.linalg.norm(quat_wxyz))
    if abs(norm - 1) > NORM_TOLERANCE:
        raise BadConfig(
            f"{path}: T_base_camera.quat_wxyz {quat_wxyz.tolist()} has length {norm:.4g}, so it is no "
            "rotation (legal: length 1, order w x y z); calibrate again with python -m hal.calibrate"
        )
    intrinsics = None if file.intrinsics is None else np.array(file.intrinsics)
    if intrinsics is not None:
        _check_pinhole(intrinsics, path)
    calibration = Calibration(
        serial=file.serial,
        T_base_camera=Pose(position=np.array(file.T_base_camera.position_m), quat_wxyz=quat_wxyz / norm),
        intrinsics=intrinsics,
        rms_translation_m=file.rms_translation_m,
        rms_rotation_rad=file.rms_rotation_rad,
        n_poses=file.n_poses,
        made=file.made,
    )
    if serial is not None and calibration.serial != serial and not calibration.by_hand:
        raise BadConfig(
            f"{path} is the calibration of camera {calibration.serial}, not of camera {serial}; calibrate "
            "this camera with python -m hal.calibrate, or set camera.calibration to its own file"
        )
    return calibration


def calibration_path(path: str | Path, cell_file: Path) -> Path:
    """Path of a cell file's ``camera.calibration``; a relative one is relative to the cell file's folder."""
    return cell_file.parent / path


def _quoted_serial(values: dict[str, Any], path: Path) -> dict[str, Any]:
    # YAML reads 012345678901 without quotes as a number, in octal even, and the zero is lost.
    if isinstance(values.get("serial"), int):
        raise BadConfig(f"{path}: 'serial' must be in quotes, got the number {values['serial']}")
    return values


def _check_pinhole(matrix: np.ndarray, path: Path) -> None:
    zeros = matrix[[0, 1, 2, 2], [1, 0, 0, 1]]
    if zeros.any() or matrix[2, 2] != 1 or matrix[0, 0] <= 0 or matrix[1, 1] <= 0:
        raise BadConfig(
            f"{path}: intrinsics {matrix.tolist()} is no pinhole matrix; legal: [[fx, 0, cx], [0, fy, cy], "
            "[0, 0, 1]] in pixels, or null for the factory's"
        )
