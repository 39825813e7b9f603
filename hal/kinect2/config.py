"""What a cell's file says about a Kinect v2."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from mskgrasp.core.config import Config

Pipeline = Literal["cpu", "opengl"]


def _quoted(value: Any) -> Any:
    if isinstance(value, int):
        raise ValueError('a serial number must be in quotes, for example "012345678901"')
    return value


Serial = Annotated[str, BeforeValidator(_quoted), Field(min_length=1)]


class PinholeIntrinsics(Config):
    """A pinhole camera in the image that `Kinect2Camera` delivers (not mirrored, 512 x 424)."""

    fx: float = Field(gt=100, lt=1000)
    """Focal length along a row, pixels."""
    fy: float = Field(gt=100, lt=1000)
    """Focal length along a column, pixels."""
    cx: float = Field(gt=0, lt=511)
    """Column of the principal point; the centre of a pixel has integer coordinates."""
    cy: float = Field(gt=0, lt=423)
    """Row of the principal point."""

    def matrix(self) -> np.ndarray:
        """(3, 3) pixels."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])


class Kinect2Config(Config):
    """Settings of a Kinect v2."""

    driver: Literal["kinect2"]
    calibration: Path
    """File with T_base_camera, as hal.calibrate writes it."""
    serial: Serial | None = None
    """Which camera, in quotes; may be left away where only one is connected."""
    pipeline: Pipeline = "cpu"
    """What decodes the depth. OpenCL and CUDA mark a bad frame with a status that pylibfreenect2 hides."""
    depth_offset: float = Field(default=0.0, ge=-0.1, le=0.1)
    """Added to every depth, m; Kinects measure some 0.02 to 0.03 m too far, each by its own constant."""
    intrinsics: dict[Serial, PinholeIntrinsics] = {}
    """By serial; goes before those of the calibration file, which go before the factory's."""
    warm_up_s: float = Field(default=1200.0, ge=0)
    """How long the depth drifts once the camera streams, s; said when it starts. 0 says nothing."""
    latency_s: float = Field(default=0.1, gt=0, le=1.0)
    """A frame is never longer on its way from the exposure to here, s; one that was counts as late."""
    max_skew_s: float = Field(default=0.1, gt=0)
    """Colour and depth of a frame are exposed at most this far apart, s."""
    min_valid: float = Field(default=0.05, gt=0, le=1.0)
    """A depth image with a smaller share of valid pixels is no frame."""
    connect_timeout_s: float = Field(default=20.0, gt=0, le=120)
    """How long the camera may take from opening to its first frame, s."""
