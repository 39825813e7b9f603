"""The overhead depth camera of the simulated cell."""

from __future__ import annotations

import time

import numpy as np

from hal.camera import Camera, RgbdFrame
from hal.errors import NotConnected
from hal.sensor_noise import SensorNoise, add_noise
from hal.sim.world import SapienWorld
from tasks.scene.camera import FAR


class SapienCamera(Camera):
    """Rendered camera over the table; it sees the arm, too.

    Args:
        world: The simulated world to render.
        noise: Noise of the sensor; off by default.
    """

    def __init__(self, world: SapienWorld, noise: SensorNoise | None = None):
        self._world = world
        self._noise = noise or SensorNoise()
        self._rng = np.random.default_rng(self._noise.seed)
        self._presented = 0
        self._open = False

    def connect(self) -> None:
        """Build the world unless the arm has built it, and restart the sensor's noise."""
        if not self._open:
            self._world.open()
            self._presented = 0
            self._open = True

    def close(self) -> None:
        """Free the world unless the arm still uses it."""
        if self._open:
            self._open = False
            self._world.close()

    def capture(self, timeout_s: float = 5.0) -> RgbdFrame:
        """Render a frame now; ``timeout_s`` is not needed.

        Raises:
            NotConnected: Outside the camera's context.
        """
        if not self._open:
            raise NotConnected("SapienCamera is not connected; use it inside its context (with ...)")
        env = self._world.env
        if self._presented != self._world.presented:
            # Reset with every part: its image must not depend on the number of parts before.
            self._presented = self._world.presented
            self._rng = np.random.default_rng([self._noise.seed, self._world.presented_seed])
        taken = time.monotonic()
        colour, depth = env.capture_rgbd(with_robot=True)
        metres = depth[0].cpu().numpy().astype(np.float32)
        metres[metres >= 0.99 * FAR] = np.nan
        intrinsics = self._world.overhead.intrinsics()
        x_min, x_max, y_min, y_max = self._world.region
        return RgbdFrame(
            colour=colour[0].cpu().numpy(),
            depth=add_noise(metres, intrinsics, self._noise, self._rng),
            intrinsics=intrinsics,
            T_base_camera=self._world.overhead.T_base_camera(((x_min + x_max) / 2, (y_min + y_max) / 2)),
            timestamp_s=taken,
            serial="sapien",
            fine_colour=self._world.fine_colour(),
        )
