"""Colour image finer than the overhead camera's depth, as a Kinect v2 has."""

from __future__ import annotations

import numpy as np
from mani_skill.sensors.camera import Camera, CameraConfig

from mskgrasp.core.settings import Overhead
from tasks import GraspDisplacementEnv
from tasks.scene.camera import camera_config, without_reflection_table

SUPERSAMPLING = 2
"""Rays along the edge of a pixel: a real pixel gathers the light of its whole area."""


class FineColour:
    """Camera with ``scale`` x ``scale`` pixels of colour for every pixel of depth, for one scene.

    Args:
        env: Environment to render.
        overhead: Settings of the overhead camera.
        scale: Number of colour pixels along an edge of a depth pixel.
    """

    def __init__(self, env: GraspDisplacementEnv, overhead: Overhead, scale: int):
        self._env = env
        self._camera = Camera(_config(overhead, env.region_centre, scale * SUPERSAMPLING), env.scene)
        without_reflection_table(self._camera)

    def capture(self) -> np.ndarray:
        """(scale h, scale w, 3) uint8, RGB, of the whole scene with the robot."""
        # Without it the first image of a new camera is black.
        self._env.scene.update_render(update_sensors=True, update_human_render_cameras=False)
        self._camera.capture()
        rays = self._camera.get_obs(rgb=True, depth=False, position=False, segmentation=False)["rgb"][0]
        rays = rays.cpu().numpy().astype(np.float32)
        n = rays.shape[0] // SUPERSAMPLING
        pixels = rays.reshape(n, SUPERSAMPLING, n, SUPERSAMPLING, 3).mean(axis=(1, 3))
        return np.rint(pixels).astype(np.uint8)


def _config(overhead: Overhead, centre_xy: tuple[float, float], factor: int) -> CameraConfig:
    config = camera_config(overhead, centre_xy)
    config.uid = "fine_colour"
    config.width *= factor
    config.height *= factor
    # With a pixel's corner at integer coordinates, as in SAPIEN, the whole matrix scales uniformly.
    intrinsics = np.array(config.intrinsic) * factor
    intrinsics[2, 2] = 1.0
    config.intrinsic = intrinsics.astype(np.float32)
    return config
