"""The overhead depth camera in SAPIEN."""

from __future__ import annotations

import numpy as np
import sapien
import torch
from mani_skill.render.shaders import ShaderConfig
from mani_skill.sensors.camera import Camera, CameraConfig

from mskgrasp.core.settings import Overhead
from tasks.scene.frames import sapien_camera_pose

NEAR, FAR = 0.2, 4.0
"""Distances between which the camera sees, m."""


def camera_config(overhead: Overhead, centre_xy: tuple[float, float]) -> CameraConfig:
    """ManiSkill's configuration of the camera, with depth in float metres."""
    intrinsics = overhead.intrinsics()
    # SAPIEN's image plane has a pixel's corner, not its centre, at integer coordinates.
    intrinsics[:2, 2] += 0.5
    return CameraConfig(
        uid="overhead",
        pose=sapien_camera_pose(overhead.T_base_camera(centre_xy)),
        width=overhead.n_pixels,
        height=overhead.n_pixels,
        near=NEAR,
        far=FAR,
        intrinsic=intrinsics.astype(np.float32),
        shader_config=FLOAT_DEPTH,
    )


def where_seen(depth: torch.Tensor) -> torch.Tensor:
    """Depth in metres, NaN where the camera sees nothing, such as beyond the table."""
    return depth.where(depth < 0.99 * FAR, torch.nan)


def without_reflection_table(camera: Camera) -> None:
    """Give a camera an empty table of the reflections of an environment, since there is no environment map.

    SAPIEN otherwise computes that table before the first picture of every process: 11 s on a software
    renderer, for a term that no environment map makes zero. Images stay the same to the bit.
    """
    empty = sapien.render.RenderTexture(np.zeros((1, 1, 4), np.float32), 2, "r32g32b32a32sfloat")
    for one in camera.camera._render_cameras:
        one.set_texture("BRDFLUT", empty)


def _metres(data: torch.Tensor) -> dict[str, torch.Tensor]:
    if data.ndim == 3:  # (n, h, w): a single camera's depth buffer has no channel axis
        data = data[..., None]
    return {"depth": NEAR * FAR / (FAR - data * (FAR - NEAR))}


# ManiSkill's "minimal" pack rounds depth to whole millimetres, towards zero; the depth buffer of the same
# pack holds it to micrometres.
FLOAT_DEPTH = ShaderConfig(
    shader_pack="minimal",
    texture_names={
        "Color": ["rgb"],
        "GbufferDepth": ["depth"],
        "PositionSegmentation": ["position", "segmentation"],
    },
    texture_transforms={
        "Color": lambda data: {"rgb": data[..., :3]},
        "GbufferDepth": _metres,
        "PositionSegmentation": lambda data: {"position": data[..., :3], "segmentation": data[..., [3]]},
    },
)
