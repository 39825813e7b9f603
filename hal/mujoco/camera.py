"""The overhead depth camera of the MuJoCo cell: casts rays, and needs neither a GPU nor a display."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from hal.camera import Camera, RgbdFrame
from hal.errors import NotConnected
from hal.mujoco.world import MujocoWorld
from hal.sensor_noise import SensorNoise, add_noise

if TYPE_CHECKING:
    from hal.mujoco.simulation import Simulation

FAR = 4.0
"""The camera sees nothing farther away, metres."""
_AMBIENT = 0.35
"""Brightness of a surface seen edge-on, as a share of one seen from the front: the light is at the camera."""


class MujocoCamera(Camera):
    """Camera that casts a ray through the centre of every pixel; it sees the arm, too.

    Args:
        world: The simulated world.
        noise: Noise of the sensor; off by default.
    """

    def __init__(self, world: MujocoWorld, noise: SensorNoise | None = None):
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
        """Take a frame now; ``timeout_s`` is not needed.

        Raises:
            NotConnected: Outside the camera's context.
        """
        if not self._open:
            raise NotConnected("MujocoCamera is not connected; use it inside its context (with ...)")
        world = self._world
        if self._presented != world.presented:
            # Reset with every part: its image must not depend on the number of parts before.
            self._presented = world.presented
            self._rng = np.random.default_rng([self._noise.seed, world.presented_seed])
        taken = time.monotonic()
        intrinsics = world.overhead.intrinsics()
        x_min, x_max, y_min, y_max = world.region
        pose = world.overhead.T_base_camera(((x_min + x_max) / 2, (y_min + y_max) / 2))
        rays_camera = _rays(world.overhead.n_pixels, intrinsics)
        colour, distance = _cast(world.simulation, pose.position, rays_camera @ pose.as_matrix()[:3, :3].T)
        depth = distance * rays_camera[..., 2]
        return RgbdFrame(
            colour=colour,
            depth=add_noise(depth, intrinsics, self._noise, self._rng),
            intrinsics=intrinsics,
            T_base_camera=pose,
            timestamp_s=taken,
            serial="mujoco",
        )


def _rays(n_pixels: int, intrinsics: np.ndarray) -> np.ndarray:
    """(n, n, 3) unit vectors through the centres of pixels, camera frame."""
    rows, columns = np.mgrid[0:n_pixels, 0:n_pixels]
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(intrinsics).T
    return rays / np.linalg.norm(rays, axis=-1, keepdims=True)


def _cast(simulation: Simulation, origin: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Colours (h, w, 3) uint8 and distances (h, w) along unit rays in base, metres; NaN without a hit."""
    import mujoco

    from hal.mujoco.panda import SEEN

    model, data = simulation.model, simulation.data
    mujoco.mj_kinematics(model, data)
    n = rays.shape[0] * rays.shape[1]
    met, distance, normal = np.full(n, -1, np.int32), np.zeros(n), np.zeros(3 * n)
    groups = np.zeros(6, np.uint8)
    groups[SEEN] = 1
    mujoco.mj_multiRay(model, data, origin, rays.reshape(-1), groups, True, -1, met, distance, normal, n, FAR)
    facing = np.abs((normal.reshape(-1, 3) * rays.reshape(-1, 3)).sum(axis=-1))
    shade = _AMBIENT + (1 - _AMBIENT) * np.nan_to_num(facing)
    colour = np.rint(255 * np.clip(model.geom_rgba[met, :3] * shade[:, None], 0, 1)).astype(np.uint8)
    colour[met < 0] = 0
    distance[met < 0] = np.nan
    return colour.reshape(*rays.shape[:2], 3), distance.reshape(rays.shape[:2])
