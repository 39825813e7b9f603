"""Simulated camera with another arm, for tests and dry runs of a real arm over an empty table."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from hal.sensor_noise import SensorNoise
from hal.sim.camera import SapienCamera
from hal.sim.world import SapienWorld
from mskgrasp.core.config import Config
from mskgrasp.core.settings import Overhead, Physics, Region


class SapienCameraConfig(Config):
    """A rendered table with a part on it, which the arm does not move."""

    driver: Literal["sapien"]
    part: str = "hex_nut_m30"
    """First part on the rendered table: a name or a folder."""
    seed: int = Field(default=0, ge=0)
    """Determines the position and turn of the part."""
    overhead: Overhead = Overhead()
    """Pose and optics of the camera."""
    noise: SensorNoise = SensorNoise()
    """Noise model: off, iid (3 mm) or kinect2; see docs/sensor_noise.md."""


def sapien_camera(
    config: SapienCameraConfig, *, region: Region, home: np.ndarray
) -> tuple[SapienCamera, SapienWorld]:
    """A rendered camera over the middle of a region, and its world, which places parts on the table.

    Args:
        config: Part on the table, optics and noise of the camera.
        region: x_min, x_max, y_min, y_max where parts lie, base frame, metres.
        home: (7,) joints of the rendered arm, radians; it does not move.

    Raises:
        ValueError: The camera does not see the region.
    """
    config.overhead.check_sees(region)
    world = SapienWorld(
        physics=Physics(),
        overhead=config.overhead,
        region=region,
        home=home,
        part=config.part,
        seed=config.seed,
    )
    return SapienCamera(world, config.noise), world
