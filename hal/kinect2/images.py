"""Conversion of libfreenect2's images to those of `hal.camera.RgbdFrame`. Pure functions."""

from __future__ import annotations

import numpy as np

WIDTH, HEIGHT = 512, 424


def metric_depth(undistorted_mm: np.ndarray, offset_m: float) -> np.ndarray:
    """Depth in metres, not mirrored, NaN where invalid.

    Args:
        undistorted_mm: (424, 512) float32; zero, negative, NaN and infinity are invalid.
        offset_m: Added to valid depths.
    """
    flipped = undistorted_mm[:, ::-1]  # libfreenect2's images are mirrored (its issue 172)
    valid = np.isfinite(flipped) & (flipped > 0)
    return np.where(valid, flipped * 1e-3 + offset_m, np.nan).astype(np.float32)


def rgb_colour(registered_bgrx: np.ndarray) -> np.ndarray:
    """(424, 512, 3) RGB, not mirrored, of (424, 512, 4) BGRX."""
    return np.ascontiguousarray(registered_bgrx[:, ::-1, 2::-1])


def unmirrored_intrinsics(fx: float, fy: float, cx: float, cy: float) -> np.ndarray:
    """(3, 3) pinhole matrix of the image that is no longer mirrored.

    libfreenect2's ``distort`` has the centre of a pixel at integer coordinates, and so have we; its
    ``getPointXYZ`` has not (it adds half a pixel, 1.4 mm at 1 m) and is not used.
    """
    return np.array([[fx, 0.0, WIDTH - 1 - cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
