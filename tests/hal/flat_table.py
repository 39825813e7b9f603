"""Depth images of a table, by plane geometry."""

from __future__ import annotations

import time

import numpy as np

from hal import RgbdFrame, Workspace
from mskgrasp.core.geometry import Pose

INTRINSICS = np.array([[365.5, 0, 79.5], [0, 365.5, 79.5], [0, 0, 1.0]])


DOWN = Pose(position=np.array([0.5, 0.0, 0.8]), quat_wxyz=np.array([0.0, 1.0, -1.0, 0.0]) / np.sqrt(2))


def frame_of_table(z: float = 0.0, slope_x: float = 0.0, part: bool = False, pose: Pose = DOWN) -> RgbdFrame:
    """A plane z + slope_x (x - 0.5) seen from `DOWN`; a part 4 cm high covers a fifth of the region."""
    rows, columns = np.mgrid[0:160, 0:160]
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(INTRINSICS).T
    unit = DOWN.apply(rays) - DOWN.position
    # origin + t unit on the plane
    normal = np.array([-slope_x, 0.0, 1.0])
    t = (normal @ (np.array([0.5, 0.0, z]) - DOWN.position)) / (unit @ normal)
    depth = t.astype(np.float32)
    if part:
        depth[50:100, 50:100] -= 0.04
    return RgbdFrame(
        colour=np.zeros((160, 160, 3), np.uint8),
        depth=depth,
        intrinsics=INTRINSICS,
        T_base_camera=pose,
        timestamp_s=time.monotonic(),
        serial="a",
    )


WORKSPACE = Workspace(
    table_z=0.0,
    region=(0.38, 0.62, -0.12, 0.12),
    home=np.zeros(7),
    min_height=0.006,
    lift_height=0.1,
    grasp_force=20.0,
)
