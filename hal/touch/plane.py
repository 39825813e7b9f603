"""Plane through touched points. Pure functions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hal.config import STEEPEST
from mskgrasp.core.errors import MskgraspError

TILT_MATTERS = 0.0005
"""A table that rises by more than this from the region's middle to a corner is written with its slope, m."""


class NoPlane(MskgraspError):
    """The touched points lie on no plane, or on too steep a one."""


@dataclass(frozen=True, kw_only=True)
class TouchedPlane:
    """Plane fitted to touched points.

    Attributes:
        z: Height in the region's middle, base frame, metres.
        slope: Rise along x and along y, metres a metre.
        residuals: (n,) heights of the points over the plane, metres.
        rise: Greatest rise from the region's middle to a corner, metres.
    """

    z: float
    slope: tuple[float, float]
    residuals: np.ndarray
    rise: float

    @property
    def tilt_rad(self) -> float:
        """Angle against the base's x-y plane."""
        return float(np.arctan(np.hypot(*self.slope)))

    @property
    def level(self) -> bool:
        """Whether the tilt is too small to matter."""
        return self.rise <= TILT_MATTERS


def fit_plane(points: np.ndarray, region: tuple[float, float, float, float], flatness: float) -> TouchedPlane:
    """Fit a plane to touched points by least squares.

    Args:
        points: (n, 3) base frame, metres, n > 3.
        region: x_min, x_max, y_min, y_max, base frame, metres.
        flatness: Greatest distance of a point from the plane, metres.

    Raises:
        NoPlane: A point is farther from the plane, or it is steeper than a cell's table may be.
    """
    x_min, x_max, y_min, y_max = region
    centre = np.array([(x_min + x_max) / 2, (y_min + y_max) / 2])
    design = np.column_stack([points[:, :2] - centre, np.ones(len(points))])
    slope_x, slope_y, z = np.linalg.lstsq(design, points[:, 2], rcond=None)[0]
    residuals = points[:, 2] - design @ [slope_x, slope_y, z]
    worst = float(np.abs(residuals).max())
    if worst > flatness:
        shown = ", ".join(
            f"{1e3 * off:+z.2f} mm at ({x:.3f}, {y:.3f}) m"
            for (x, y), off in zip(points[:, :2], residuals, strict=True)
        )
        raise NoPlane(
            f"the {len(points)} touches fit no plane: {shown}; {1e3 * flatness:g} mm are accepted "
            "(--flatness). Remove what lies on the table, or level a warped one, and touch it again"
        )
    if max(abs(slope_x), abs(slope_y)) > STEEPEST:
        raise NoPlane(
            f"the touched table rises by {1e3 * slope_x:.0f} mm a metre along x, {1e3 * slope_y:.0f} along "
            f"y; at most {1e3 * STEEPEST:g} either way are possible. Level it, or clear what the fingers met"
        )
    half = np.array([x_max - x_min, y_max - y_min]) / 2
    return TouchedPlane(
        z=float(z),
        slope=(float(slope_x), float(slope_y)),
        residuals=residuals,
        rise=float(np.abs([slope_x, slope_y]) @ half),
    )
