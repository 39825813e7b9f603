"""Footprint of a part on the table, from a depth image or from its CAD file."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import trimesh

from hal.camera import RgbdFrame
from mskgrasp.core.geometry import pixel_rays, quat_rotate, wrap_half_turn
from mskgrasp.parts import Part
from mskgrasp.perception.part_detection import find_part_pixels


@dataclass(frozen=True, kw_only=True)
class Footprint:
    """Smallest rectangle around a part seen from above.

    Attributes:
        sides: (2,) the longer and the shorter one, metres.
        theta: Direction of the longer side from base x, radians in [-pi/2, pi/2).
    """

    sides: np.ndarray
    theta: float

    def extent(self, theta: float) -> np.ndarray:
        """Compute the extent (2,) along base x and y with the longer side at ``theta``, metres."""
        cos, sin = abs(np.cos(theta)), abs(np.sin(theta))
        long, short = self.sides
        return np.array([cos * long + sin * short, sin * long + cos * short])


def footprint_of(points: np.ndarray) -> Footprint:
    """Fit the footprint of points (n, 2), base frame, metres."""
    # In millimetres, as OpenCV's single precision is too coarse for metres.
    _, (width, height), angle = cv2.minAreaRect((np.asarray(points) * 1e3).astype(np.float32))
    long, short = max(width, height), min(width, height)
    theta = np.radians(angle + (0.0 if width >= height else 90.0))
    return Footprint(sides=np.array([long, short]) * 1e-3, theta=float(wrap_half_turn(np.asarray(theta))))


def narrowest_width(points: np.ndarray) -> float:
    """Compute the least distance between two parallel lines that enclose points (n, 2), metres."""
    hull = cv2.convexHull((np.asarray(points) * 1e3).astype(np.float32))[:, 0].astype(np.float64) * 1e-3
    sides = np.roll(hull, -1, axis=0) - hull
    lengths = np.linalg.norm(sides, axis=1)
    # The narrowest strip lies along a side of the hull.
    normals = np.column_stack([-sides[:, 1], sides[:, 0]])[lengths > 0] / lengths[lengths > 0, None]
    across = hull @ normals.T
    return float((across.max(axis=0) - across.min(axis=0)).min()) if across.size else 0.0


def seen_points(frame: RgbdFrame) -> np.ndarray:
    """Compute the points (h * w, 3) of a frame's pixels, base frame, metres; NaN where invalid."""
    depth = np.asarray(frame.depth, dtype=np.float64)
    points_camera = pixel_rays(depth.shape, frame.intrinsics) * depth[..., None]
    return frame.T_base_camera.apply(points_camera.reshape(-1, 3))


def pixel_pitch(frame: RgbdFrame) -> float:
    """Compute the distance of neighbouring pixels at the median depth, metres."""
    return float(np.nanmedian(frame.depth)) / float(frame.intrinsics[0][0])


def seen_footprint(
    frame: RgbdFrame,
    *,
    table_z: float,
    region: tuple[float, float, float, float],
    min_height: float,
    part_height: float = math.inf,
) -> Footprint:
    """Detect the footprint of the part in a frame.

    Args:
        frame: Frame of the part on the table.
        table_z: Height of the table, base frame, metres.
        region: x_min, x_max, y_min, y_max in which the part's centre lies, base frame, metres.
        min_height: Least height of a part above the table, metres.
        part_height: As of `find_part_pixels`.

    Raises:
        NoPartFound: No part is detected.
    """
    found = find_part_pixels(
        frame.depth,
        frame.intrinsics,
        frame.T_base_camera,
        table_z=table_z,
        region=region,
        min_height=min_height,
        part_height=part_height,
    )
    inner = footprint_of(found.points_base[:2, found.mask].T)
    # An edge is, on average, half a pixel further out than the last pixel on it.
    return Footprint(sides=inner.sides + pixel_pitch(frame), theta=inner.theta)


def usual_footprint(part: Part) -> Footprint:
    """Compute the footprint of a part in its most probable resting pose; theta is 0."""
    mesh = trimesh.load_mesh(part.mesh_path)
    quat_wxyz = part.resting.quat_wxyz[int(np.argmax(part.resting_probability))]
    found = footprint_of(quat_rotate(quat_wxyz, np.asarray(mesh.vertices))[:, :2])
    return Footprint(sides=found.sides, theta=0.0)
