"""The overhead depth camera of the MuJoCo cell: casts rays, and needs neither a GPU nor a display."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hal.mujoco.world import MujocoWorld
from hal.simulated import SimulatedCamera
from mskgrasp.core.geometry import pixel_rays

if TYPE_CHECKING:
    from hal.mujoco.simulation import Simulation

FAR = 4.0
"""The camera sees nothing farther away, metres."""
_AMBIENT = 0.35
"""Brightness of a surface seen edge-on, as a share of one seen from the front: the light is at the camera."""


class MujocoCamera(SimulatedCamera[MujocoWorld]):
    """Camera that casts a ray through the centre of every pixel; it sees the arm, too."""

    serial = "mujoco"

    def _render(self) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        world, pose = self._world, self._world.T_base_camera
        rays_camera = _rays(world.overhead.n_pixels, world.overhead.intrinsics())
        colour, distance = _cast(world.simulation, pose.position, rays_camera @ pose.as_matrix()[:3, :3].T)
        return colour, distance * rays_camera[..., 2], None


def _rays(n_pixels: int, intrinsics: np.ndarray) -> np.ndarray:
    """(n, n, 3) unit vectors through the centres of pixels, camera frame."""
    rays = pixel_rays((n_pixels, n_pixels), intrinsics)
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
