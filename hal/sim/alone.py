"""Simulated camera with another arm, for tests and dry runs of a real arm over an empty table."""

from __future__ import annotations

import numpy as np

from hal.sim.camera import SapienCamera
from hal.sim.config import SapienCameraConfig
from hal.sim.world import SapienWorld
from mskgrasp.core.settings import Physics, Region


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
