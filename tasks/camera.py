"""The overhead depth camera: a Kinect v2 looking straight down, windowed to the region of the parts."""

from __future__ import annotations

import numpy as np
import sapien
import torch
from mani_skill.render.shaders import ShaderConfig
from mani_skill.sensors.camera import Camera, CameraConfig
from pydantic import Field

from mskgrasp.config import Config
from mskgrasp.geometry import Pose
from tasks.frames import sapien_camera_pose

NEAR, FAR = 0.2, 4.0


class Overhead(Config):
    """Where the camera hangs and what it sees."""

    height: float = Field(default=0.8, gt=0.3, lt=3)
    """Height over the table, m."""
    focal_px: float = Field(default=365.5, gt=0)
    """Focal length, pixels (Kinect v2's infrared camera: 365.456 by its factory calibration)."""
    n_pixels: int = Field(default=160, ge=32, le=424)
    """Width and height of the window, pixels; 160 see 35 cm of a table 0.8 m away."""

    def intrinsics(self) -> np.ndarray:
        """(3, 3) pinhole matrix; the centre of a pixel has integer coordinates."""
        centre = (self.n_pixels - 1) / 2
        return np.array([[self.focal_px, 0, centre], [0, self.focal_px, centre], [0, 0, 1.0]])

    def check_sees(self, region: tuple[float, float, float, float]) -> None:
        """Refuses a region that the image does not show whole.

        Raises:
            ValueError: Says how much it shows.
        """
        x_min, x_max, y_min, y_max = region
        if not (x_min < x_max and y_min < y_max):
            raise ValueError(f"region must be x_min < x_max, y_min < y_max, got {list(region)}")
        seen = self.n_pixels * self.height / self.focal_px
        if max(x_max - x_min, y_max - y_min) > seen:
            raise ValueError(
                f"the camera sees {seen:.2f} m of the table, less than the region {list(region)}"
            )

    def T_base_camera(self, centre_xy: tuple[float, float]) -> Pose:  # noqa: N802 (a pose's name)
        """The optical frame over ``centre_xy`` (base frame, m): the image's top is away from the base."""
        matrix = np.eye(4)
        matrix[:3, :3] = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
        matrix[:3, 3] = (*centre_xy, self.height)
        return Pose.from_matrix(matrix)


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


def without_reflection_table(camera: Camera) -> None:
    """Gives a camera an empty table of how glossy surfaces reflect an environment, of which there is none.

    SAPIEN otherwise computes that table before the first picture of every process: 11 s on a software
    renderer, for a term that no environment map makes zero. Pictures stay the same to the bit.
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
