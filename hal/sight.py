"""Detection of an arm in a camera's view of the region of the parts, from its joints."""

from __future__ import annotations

import numpy as np

from hal.camera import RgbdFrame
from hal.cell import Workspace
from mskgrasp.core.panda_body import Links

AROUND = 0.05
"""Distance from the region at which a part is still looked for, metres."""
_OUTLINE = 0.02
"""Depth by which a link may lie within its capsule, metres."""
_STEP = 0.01
"""Distance of the checked points along a link's axis, metres."""


def link_in_sight(links: Links, joints: np.ndarray, frame: RgbdFrame, workspace: Workspace) -> str:
    """Name of a link that a frame shows over the region, or whose axis it shows before it; empty: none.

    Args:
        links: The arm's links.
        joints: (7,) radians, when the frame was taken.
        frame: Of the camera.
        workspace: Region and table.
    """
    first, second = links.segments(np.asarray(joints, dtype=np.float64))
    eye, table_z = np.asarray(frame.T_base_camera.position, dtype=np.float64), workspace.table_z
    low, high = np.reshape(workspace.region, (2, 2)).T
    limit = np.array(frame.depth.shape[::-1]) - 1
    for link, start, end in zip(links.capsules, first, second, strict=True):
        n = max(2, int(np.ceil(np.linalg.norm(end - start) / _STEP)))
        points = start + np.linspace(0.0, 1.0, n)[:, None] * (end - start)
        points = points[(points[:, 2] > table_z) & (points[:, 2] < eye[2] - _STEP)]
        rays = frame.T_base_camera.inverse().apply(points) @ frame.intrinsics.T
        pixels = rays[:, :2] / np.maximum(rays[:, 2:], 1e-6)
        points = points[((pixels >= 0) & (pixels <= limit)).all(axis=1) & (rays[:, 2] > 0)]
        scale = (eye[2] - table_z) / (eye[2] - points[:, 2])
        behind = eye[:2] + scale[:, None] * (points[:, :2] - eye[:2])
        around = AROUND + max(0.0, link.radius - _OUTLINE)
        over = ((low - around < points[:, :2]) & (points[:, :2] < high + around)).all(axis=1)
        if (over | ((low < behind) & (behind < high)).all(axis=1)).any():
            return link.name
    return ""
