"""Frame whose colour may be finer than its depth, and projection between its pixels and the base frame."""

from __future__ import annotations

import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.core.errors import MarkersNotFound
from mskgrasp.core.geometry import quat_to_matrix

LEAST_DEPTHS = 3
"""Least valid depths on a spot, so that a flying pixel does not decide the median."""


class RegisteredFrame:
    """Colour and depth of one frame.

    Args:
        frame: The frame; its fine colour is used where it has one.
        table_z: Height of the table, base frame, metres.

    Attributes:
        colour: (k h, k w, 3) uint8, RGB.
        scale: k.
        focal: Focal length in pixels of ``colour``.

    Raises:
        MarkersNotFound: The colour image is not registered to depth.
    """

    def __init__(self, frame: RgbdFrame, table_z: float):
        self.colour = frame.colour if frame.fine_colour is None else frame.fine_colour
        h, w = frame.depth.shape
        self.scale = self.colour.shape[0] // h
        if self.scale < 1 or self.colour.shape != (self.scale * h, self.scale * w, 3):
            raise MarkersNotFound(
                f"a colour image of shape {self.colour.shape} is not registered to depth of "
                f"{frame.depth.shape}; its sides must be those of depth, or the same whole multiple of them"
            )
        intrinsics = np.asarray(frame.intrinsics, dtype=np.float64)
        rotation = quat_to_matrix(np.asarray(frame.T_base_camera.quat_wxyz, dtype=np.float64))
        self.focal = float(intrinsics[0, 0] + intrinsics[1, 1]) / 2 * self.scale
        self._origin = np.asarray(frame.T_base_camera.position, dtype=np.float64)
        self._to_base = rotation @ np.linalg.inv(intrinsics)
        self._to_pixels = intrinsics @ rotation.T
        self._depth = frame.depth
        self._table_z = table_z

    def depth_pixel(self, colour_pixel: np.ndarray) -> np.ndarray:
        """Convert pixels (..., 2) of the colour image to those of the depth image."""
        return (colour_pixel + 0.5) / self.scale - 0.5

    def colour_pixel(self, point_base: np.ndarray) -> np.ndarray:
        """Project points (..., 3) of the base frame to pixels (..., 2) of the colour image."""
        seen = (point_base - self._origin) @ self._to_pixels.T
        return (seen[..., :2] / seen[..., 2:] + 0.5) * self.scale - 0.5

    def point_base(self, colour_pixel: np.ndarray, depth: float) -> np.ndarray:
        """Compute the point (3,) of a pixel (2,) of the colour image at a depth, base frame, metres."""
        return depth * (self._to_base @ [*self.depth_pixel(colour_pixel), 1.0]) + self._origin

    def depth_at_height(self, colour_pixel: np.ndarray, height: float) -> float:
        """Compute the depth of a pixel's ray (2,) at a height above the table, metres."""
        slope = self._to_base[2] @ [*self.depth_pixel(colour_pixel), 1.0]
        return float((self._table_z + height - self._origin[2]) / slope)

    def depths_within(self, colour_pixels: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray:
        """Get the valid depths (k,), metres, of the pixels in ``colour_pixels`` near their centre.

        Args:
            colour_pixels: (n, 2) pixels of the surface.
            centre: (2,) of it.
            radius: Pixels of the colour image, along both axes, at least one pixel of depth: farther out,
                flying pixels lie between the surface and the background.
        """
        near = np.abs(colour_pixels - centre).max(axis=1, initial=0.0) <= max(radius, self.scale)
        if not near.any():
            return np.empty(0)
        columns, rows = np.unique(np.rint(self.depth_pixel(colour_pixels[near])).astype(int), axis=0).T
        values = self._depth[rows, columns]
        return values[np.isfinite(values)].astype(np.float64)
