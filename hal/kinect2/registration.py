"""Colour of a Kinect v2 registered to its depth, at a multiple of depth's resolution."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np

from hal.kinect2.images import HEIGHT, WIDTH

COLOUR_WIDTH, COLOUR_HEIGHT = 1920, 1080
_DEPTH_Q, _COLOUR_Q = 0.01, 0.002199
"""Units of the factory's polynomials (libfreenect2, ``registration.cpp``)."""
POWERS = ((3, 0), (0, 3), (2, 1), (1, 2), (2, 0), (0, 2), (1, 1), (1, 0), (0, 1), (0, 0))
"""Powers of column and row in the factory's polynomials."""
_HIDDEN = 0.01
"""A point farther than the nearest one on the same colour pixel by this share of its depth is hidden."""
_SPLAT = np.ones((3, 5), np.uint8)
"""Colour pixels, rows and columns, that a depth pixel covers; both as in ``registration.cpp``."""


class Registration:
    """The factory's map from depth pixels to colour pixels.

    The two cameras hang side by side, so that the column depends on the depth, by some 2 pixels of colour
    for 24 mm at 0.8 m: depth must be corrected first. libfreenect2's own registration offers neither that
    nor a finer image.

    Args:
        lens: ``IrCameraParams`` of libfreenect2.
        colour: Its ``ColorCameraParams``.
        scale: Colour pixels along the edge of a depth pixel.
    """

    def __init__(self, lens: Mapping[str, float], colour: Mapping[str, float], scale: int):
        self._scale = scale
        # libfreenect2's images are mirrored, ours are not.
        columns = WIDTH - 1 - ((np.arange(scale * WIDTH) + 0.5) / scale - 0.5)
        rows = (np.arange(scale * HEIGHT) + 0.5) / scale - 0.5
        x, y = (columns - lens["cx"]) * _DEPTH_Q, (rows[:, None] - lens["cy"]) * _DEPTH_Q
        along, down = (
            sum(colour[f"{axis}_x{i}y{j}"] * x**i * y**j for i, j in POWERS) for axis in ("mx", "my")
        )
        far = along / _COLOUR_Q - colour["shift_m"] / colour["shift_d"] * colour["fx"] + colour["cx"]
        self._columns = np.asarray(far, np.float32)
        self._rows = np.asarray(down / _COLOUR_Q + colour["cy"], np.float32)
        self._shift = np.float32(colour["shift_m"] * 1e-3 * colour["fx"])

    def colour_pixels(self, depth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Columns and rows (k h, k w) of the colour image, float32, for depths (k h, k w) in metres."""
        return self._columns + self._shift / depth, self._rows

    def apply(self, colour_bgrx: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """Colour (k h, k w, 3), RGB, as the depth camera would see it; black where only that one sees.

        Args:
            colour_bgrx: (1080, 1920, 4) uint8 as libfreenect2 delivers it, mirrored.
            depth: (424, 512) metres, corrected and not mirrored, NaN where invalid; there the nearest valid
                depth stands in, at least one is needed.
        """
        depth = cv2.medianBlur(_filled(depth), 3)  # a flying pixel does not displace its colour
        k = self._scale
        fine = depth.repeat(k, axis=0).repeat(k, axis=1)
        columns, rows = self.colour_pixels(fine)
        image = cv2.remap(colour_bgrx, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        image[_hidden(columns, rows, fine)] = 0
        return np.ascontiguousarray(image[..., 2::-1])


def _filled(depth: np.ndarray) -> np.ndarray:
    """Depth with the nearest valid pixel where it is invalid."""
    from scipy.ndimage import distance_transform_edt  # the driver's process starts sooner without SciPy

    invalid = ~np.isfinite(depth)
    nearest: np.ndarray = distance_transform_edt(invalid, return_distances=False, return_indices=True)  # pyright: ignore[reportAssignmentType]
    return depth[tuple(nearest)]


def _hidden(columns: np.ndarray, rows: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Which points the colour camera sees covered by nearer ones."""
    column = np.rint(columns).astype(int).clip(0, COLOUR_WIDTH - 1)
    row = np.rint(rows).astype(int).clip(0, COLOUR_HEIGHT - 1)
    place = row * COLOUR_WIDTH + column
    nearest = np.full(COLOUR_WIDTH * COLOUR_HEIGHT, np.inf, np.float32)
    np.minimum.at(nearest, place.ravel(), depth.ravel())
    nearest = cv2.erode(nearest.reshape(COLOUR_HEIGHT, COLOUR_WIDTH), _SPLAT).ravel()
    return depth - nearest[place] > _HIDDEN * depth
