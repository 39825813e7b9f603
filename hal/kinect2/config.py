"""Configuration of a Kinect v2."""

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
    """Serial number, in quotes; optional if only one camera is connected."""
    pipeline: Pipeline = "cpu"
    """Decoder of depth. OpenCL and CUDA mark a bad frame with a status that pylibfreenect2 hides."""
    depth_offset: float = Field(default=0.0, ge=-0.1, le=0.1)
    """Added to every depth, m; Kinects measure some 0.02 to 0.03 m too far, each by its own constant."""
    exposures: int = Field(default=9, ge=1, le=20)
    """Exposures of a frame, 30 a second; depth (noise of one: 1.3 mm) and infrared are their median. With
    over 20 the noise would be so small that part detection takes the image for an exact one."""
    colour_scale: int = Field(default=3, ge=1, le=4)
    """Pixels of ``fine_colour`` along the edge of a depth pixel; 3 is the camera's own, 1: no fine colour."""
    intrinsics: dict[Serial, PinholeIntrinsics] = {}
    """By serial; override those of the calibration file, which override the factory's."""
    warm_up_s: float = Field(default=1200.0, ge=0)
    """Time for which the depth drifts once the camera streams, s, for a warning at the start; 0: none."""
    latency_s: float = Field(default=0.1, gt=0, le=1.0)
    """Greatest time from a frame's exposure to its arrival, s; a slower frame counts as late."""
    max_skew_s: float = Field(default=0.1, gt=0)
    """Greatest time between the exposures of colour and depth of a frame, s."""
    min_valid: float = Field(default=0.05, gt=0, le=1.0)
    """Least fraction of valid pixels in a depth image."""
    connect_timeout_s: float = Field(default=20.0, gt=0, le=120)
    """Time the camera has from opening to its first frame, s."""
