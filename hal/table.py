"""Plane of the table in a depth image. Pure functions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mskgrasp.core.geometry import Pose, pixel_rays

HIGHEST_TABLE = 0.002
"""Greatest height over its stated one at which a table may be seen, m: less than the hand's clearance."""
_INLIER = 0.012
"""Greatest distance of the table's points from the plane, metres: about five times a Kinect v2's noise."""
_LEAST_POINTS = 200
_ROUNDS = 60


@dataclass(frozen=True, kw_only=True)
class TablePlane:
    """Plane fitted to the table.

    Attributes:
        z: Its height in the middle of the region, base frame, metres.
        tilt_rad: Its angle against the base's x-y plane.
        slope: (2,) its rise along x and along y, metres a metre.
        noise: RMS distance of the table's points from it, metres.
        share: Fraction of the region's points on the plane.
        valid: Fraction of the region's pixels with a depth.
    """

    z: float
    tilt_rad: float
    slope: tuple[float, float]
    noise: float
    share: float
    valid: float


def points_in_base(depth: np.ndarray, intrinsics: np.ndarray, T_base_camera: Pose) -> np.ndarray:
    """(h, w, 3) points of a depth image (h, w) in metres, base frame; NaN where invalid."""
    return T_base_camera.apply(pixel_rays(depth.shape, intrinsics) * depth[..., None].astype(np.float64))


def fit_table(
    depth: np.ndarray,
    intrinsics: np.ndarray,
    T_base_camera: Pose,
    region: tuple[float, float, float, float],
    table_z: float,
) -> TablePlane | None:
    """Fit the plane of most points in the region; parts on it are outliers.

    Args:
        depth: (h, w) metres, NaN where invalid.
        intrinsics: (3, 3) pinhole matrix in pixels.
        T_base_camera: The camera's optical frame in the base.
        region: x_min, x_max, y_min, y_max, base frame, metres.
        table_z: Expected height of the table, metres; it decides which pixels see the region.

    Returns:
        None if too little of the region has a depth.
    """
    seeing = _pixels_of(depth.shape, intrinsics, T_base_camera, region, table_z)
    points = points_in_base(depth, intrinsics, T_base_camera)[seeing]
    valid = np.isfinite(points).all(axis=-1)
    points = points[valid]
    if len(points) < _LEAST_POINTS:
        return None
    centre = np.array([(region[0] + region[1]) / 2, (region[2] + region[3]) / 2])
    across = points[:, :2] - centre
    design = np.column_stack([across, np.ones(len(points))])
    rng = np.random.default_rng(0)  # the same image gives the same plane
    inliers = np.zeros(len(points), dtype=bool)
    for _ in range(_ROUNDS):
        some = rng.choice(len(points), 3, replace=False)
        if np.linalg.cond(design[some]) > 1e3:
            continue
        near = np.abs(design @ np.linalg.solve(design[some], points[some, 2]) - points[:, 2]) < _INLIER
        if near.sum() > inliers.sum():
            inliers = near
    if inliers.sum() < _LEAST_POINTS:
        return None
    plane = np.zeros(3)
    for _ in range(3):
        plane = np.linalg.lstsq(design[inliers], points[inliers, 2], rcond=None)[0]
        inliers = np.abs(design @ plane - points[:, 2]) < _INLIER
    rest = (points[:, 2] - design @ plane)[inliers]
    return TablePlane(
        z=float(plane[2]),
        tilt_rad=float(np.arctan(np.linalg.norm(plane[:2]))),
        slope=(float(plane[0]), float(plane[1])),
        noise=float(np.sqrt(np.mean(rest**2))),
        share=float(inliers.mean()),
        valid=float(valid.mean()),
    )


def _pixels_of(
    shape: tuple[int, ...],
    intrinsics: np.ndarray,
    T_base_camera: Pose,
    region: tuple[float, float, float, float],
    table_z: float,
) -> np.ndarray:
    """(h, w) bool: pixels whose line of sight meets the table inside the region."""
    origin = np.asarray(T_base_camera.position)
    unit = points_in_base(np.ones(shape), intrinsics, T_base_camera) - origin
    down = unit[..., 2] < -1e-6
    with np.errstate(divide="ignore", invalid="ignore"):
        hit = origin + unit * ((table_z - origin[2]) / unit[..., 2])[..., None]
    x, y = hit[..., 0], hit[..., 1]
    return down & (x >= region[0]) & (x <= region[1]) & (y >= region[2]) & (y <= region[3])
