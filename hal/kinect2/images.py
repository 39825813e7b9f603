"""Conversion of libfreenect2's depth and infrared images to those of `hal.camera.RgbdFrame`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import cv2
import numpy as np

WIDTH, HEIGHT = 512, 424


def median_of_valid(images: Sequence[np.ndarray]) -> np.ndarray:
    """Median of each pixel over the images that measured it; 0 where fewer than half of them did.

    Args:
        images: (h, w) float32 each; zero, negative, NaN and infinity are invalid.
    """
    stack = np.stack(images)
    stack[~(np.isfinite(stack) & (stack > 0))] = np.inf
    stack.sort(axis=0)
    n_valid = np.isfinite(stack).sum(axis=0)
    lower, upper = (
        np.take_along_axis(stack, middle.clip(0)[None], axis=0)[0]
        for middle in ((n_valid - 1) // 2, n_valid // 2)
    )
    measured = (n_valid > 0) & (2 * n_valid >= len(stack))
    # With an odd number of valid images both indices are the same, with an even one they are neighbours.
    return np.where(measured, lower / 2 + upper / 2, 0).astype(np.float32)


def metric_depth(undistorted_mm: np.ndarray, offset_m: float) -> np.ndarray:
    """Depth in metres, NaN where invalid.

    Args:
        undistorted_mm: (424, 512) float32; zero, negative, NaN and infinity are invalid.
        offset_m: Added to valid depths.
    """
    valid = np.isfinite(undistorted_mm) & (undistorted_mm > 0)
    return np.where(valid, undistorted_mm * 1e-3 + offset_m, np.nan).astype(np.float32)


class Undistortion:
    """Images of the depth sensor made those of a pinhole camera, and no longer mirrored.

    Args:
        lens: ``IrCameraParams`` of libfreenect2: fx, fy, cx, cy in pixels, k1, k2, k3, p1, p2.
    """

    def __init__(self, lens: Mapping[str, float]):
        # As libfreenect2's `distort`, whose pixels have their centres at integer coordinates.
        f = {name: np.float32(value) for name, value in lens.items()}
        rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)
        columns = columns[:, ::-1]  # libfreenect2's images are mirrored (its issue 172)
        x, y = (columns - f["cx"]) / f["fx"], (rows - f["cy"]) / f["fy"]
        r2, xy = x * x + y * y, 2 * x * y
        radial = 1 + ((f["k3"] * r2 + f["k2"]) * r2 + f["k1"]) * r2
        self._columns = f["fx"] * (x * radial + f["p2"] * (r2 + 2 * x * x) + f["p1"] * xy) + f["cx"]
        self._rows = f["fy"] * (y * radial + f["p1"] * (r2 + 2 * y * y) + f["p2"] * xy) + f["cy"]
        column, row = (self._columns + 0.5).astype(int), (self._rows + 0.5).astype(int)
        self._inside = (column >= 0) & (column < WIDTH) & (row >= 0) & (row < HEIGHT)
        self._nearest = row.clip(0, HEIGHT - 1), column.clip(0, WIDTH - 1)

    def nearest(self, raw: np.ndarray) -> np.ndarray:
        """The nearest pixels of an image, 0 outside: depths of an edge must not be mixed."""
        return np.where(self._inside, raw[self._nearest], raw.dtype.type(0))

    def interpolated(self, raw: np.ndarray) -> np.ndarray:
        """The image between the pixels, 0 outside: nearest ones would displace corners by half a pixel."""
        return cv2.remap(raw, self._columns, self._rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)


def unmirrored_intrinsics(fx: float, fy: float, cx: float, cy: float) -> np.ndarray:
    """(3, 3) pinhole matrix of the image that is no longer mirrored.

    libfreenect2's ``distort`` has the centre of a pixel at integer coordinates, and so have we; its
    ``getPointXYZ`` has not (it adds half a pixel, 1.4 mm at 1 m) and is not used.
    """
    return np.array([[fx, 0.0, WIDTH - 1 - cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
