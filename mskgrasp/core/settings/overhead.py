"""The overhead depth camera: a Kinect v2 looking straight down, windowed to the region of the parts."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from mskgrasp.core.config import Config
from mskgrasp.core.geometry import Pose


class Overhead(Config):
    """Pose and intrinsics of the overhead camera."""

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
        """Check that the image shows all of a region.

        Raises:
            ValueError: The region is empty or larger than the part of the table that the camera sees.
        """
        x_min, x_max, y_min, y_max = region
        if not (x_min < x_max and y_min < y_max):
            raise ValueError(f"region must be x_min < x_max, y_min < y_max, got {list(region)}")
        seen = self.n_pixels * self.height / self.focal_px
        if max(x_max - x_min, y_max - y_min) > seen:
            raise ValueError(
                f"the camera sees {seen:.2f} m of the table, less than the region {list(region)}"
            )

    def T_base_camera(self, centre_xy: tuple[float, float]) -> Pose:
        """The optical frame over ``centre_xy`` (base frame, m): the image's top is away from the base."""
        matrix = np.eye(4)
        matrix[:3, :3] = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
        matrix[:3, 3] = (*centre_xy, self.height)
        return Pose.from_matrix(matrix)
