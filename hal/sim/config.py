"""Configurations of the simulated cell and of its camera alone."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from hal.config import SimulatedCellConfig
from hal.sensor_noise import SensorNoise
from mskgrasp.core.config import Config
from mskgrasp.core.settings import Overhead, Physics, Tape


class SapienCellConfig(SimulatedCellConfig):
    """Settings of the simulated cell."""

    type: Literal["sapien"]
    physics: Physics = Physics()
    """Settings of the physics."""
    tape: Tape | None = None
    """Two squares of white tape on top of every part, as markers; null: none. See docs/markers.md."""
    colour_scale: int = Field(default=1, ge=1, le=6)
    """Above 1, frames also hold a colour image finer than depth by this factor (a Kinect v2: 3)."""


class SapienCameraConfig(Config):
    """A rendered table with a part on it, which the arm does not move."""

    driver: Literal["sapien"]
    part: str = "hex_nut_m30"
    """First part on the rendered table: a name or a folder."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Determines the position and turn of the part."""
    overhead: Overhead = Overhead()
    """Pose and optics of the camera."""
    noise: SensorNoise = SensorNoise()
    """Noise model: off, iid (3 mm) or kinect2; see docs/sensor_noise.md."""
