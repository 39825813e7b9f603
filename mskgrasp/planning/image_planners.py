"""Planners that need no model: centroid and short axis, and an antipodal pair of edges of the depth image."""

from __future__ import annotations

import numpy as np
import torch

from hal.camera import RgbdFrame
from hal.cell import Workspace
from mskgrasp.core.errors import NoGraspFound
from mskgrasp.core.grasp import (
    FINGER_HALF_WIDTH,
    MAX_OPENING,
    PAD_REACH,
    PALM_HEIGHT,
    Grasp,
    PartView,
    sample_grasps,
)
from mskgrasp.perception.part_detection import find_part_pixels
from mskgrasp.planning.proposal import ProposedGrasp, view_of
from mskgrasp.planning.refine import hand_room
from mskgrasp.planning.scoring import Scene

PALM_CLEARANCE = 0.005
"""Least distance of the palm from the top of the part, metres."""
N_CANDIDATES = 1500
"""Grasps of which `AntipodalPlanner` chooses one."""
FRICTION_CONE = float(np.arctan(0.5))
"""Greatest angle between an edge and the pad that closes on it, radians: that of a friction of 0.5."""
_STEP = 0.001
_DEEP = 0.002
"""Edges are those of what rises so far over the tips of the fingers, and lies within so much of a pad, m."""


class CentroidPlanner:
    """Planner that closes the fingers on the centroid of the part's pixels, along their short axis."""

    def __init__(self, workspace: Workspace):
        self._workspace = workspace

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> ProposedGrasp:
        """Plan a grasp of the part in a frame.

        Raises:
            NoPartFound: No part is detected.
        """
        points = _part_points(frame, self._workspace)
        centroid = points.mean(axis=0)
        _, axes = np.linalg.eigh(np.cov((points - centroid).T))
        # The grasp's x runs along the pads: along the part's long axis.
        theta = float(np.arctan2(axes[1, 1], axes[0, 1]))
        z = _height(view_of(frame, self._workspace), self._workspace, centroid[None])
        return ProposedGrasp(grasp=Grasp.from_vector(np.array([*centroid, z[0], theta])))


class AntipodalPlanner:
    """Planner of the most opposite pair of edges near the centroid, between which the open hand has room.

    Grasps are drawn over the part and centred between the edges that their pads would meet. The slope of an
    edge is that of a line through what lies within 2 mm of the pad. The grasp of least cost is taken: the
    greater angle between edge and pad in units of the friction cone, plus the distance from the centroid in
    units of the part's radius of gyration.
    """

    def __init__(self, workspace: Workspace):
        self._workspace = workspace

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> ProposedGrasp:
        """Plan a grasp of the part in a frame.

        Raises:
            NoPartFound: No part is detected.
            NoGraspFound: No edges within reach are opposite.
        """
        workspace = self._workspace
        view = view_of(frame, workspace)
        scene = Scene.of(frame, view, workspace.table_z, torch.device("cpu"))
        grasps = sample_grasps(view, N_CANDIDATES, rng)
        grasps[:, 2] = _height(view, workspace, grasps[:, :2])
        shift, _ = edges_between(scene, grasps)
        along = np.column_stack([-np.sin(grasps[:, 3]), np.cos(grasps[:, 3])])
        grasps = grasps[np.isfinite(shift)]
        grasps[:, :2] += (shift[:, None] * along)[np.isfinite(shift)]
        _, angle = edges_between(scene, grasps)
        centroid = _part_points(frame, workspace).mean(axis=0)
        away = np.linalg.norm(grasps[:, :2] - centroid, axis=1) / max(view.gyration_radius, 1e-3)
        cost = np.where(angle <= FRICTION_CONE, angle / FRICTION_CONE + away, np.inf)
        for row in np.argsort(cost, kind="stable"):
            if not np.isfinite(cost[row]):
                break
            free, between = hand_room(scene, grasps[row : row + 1])
            if free[0] and between[0]:
                return ProposedGrasp(grasp=Grasp.from_vector(grasps[row]))
        raise NoGraspFound(
            "no two opposite edges of the part have room for the open hand; turn the part over"
        )


def edges_between(scene: Scene, grasps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the edges on which the pads of grasps would close.

    Args:
        scene: The part.
        grasps: (n, 4) base frame.

    Returns:
        The middle between both edges along the closing direction (n,), metres, NaN where nothing lies between
        the pads, and the greater angle between an edge and its pad (n,), radians, infinite there.
    """
    rows, columns = 2 * round(MAX_OPENING / 2 / _STEP) + 1, 2 * round(FINGER_HALF_WIDTH / _STEP) + 1
    heights = scene.crop_of(grasps, (rows, columns), _STEP)[:, 0].cpu().double().numpy()
    tips = grasps[:, 2] - scene.table_z - PAD_REACH
    solid = heights > np.maximum(tips, 0.0)[:, None, None] + _DEEP
    # The first row of a crop is the farthest along the closing direction.
    y = -(np.arange(rows) - (rows - 1) / 2) * _STEP
    x = (np.arange(columns) - (columns - 1) / 2) * _STEP
    some = solid.max(axis=1)
    far = np.where(some, y[solid.argmax(axis=1)], -np.inf)
    near = np.where(some, y[rows - 1 - solid[:, ::-1].argmax(axis=1)], np.inf)
    found = some.max(axis=1)
    with np.errstate(invalid="ignore"):
        middle = np.where(found, (far.max(axis=1) + near.min(axis=1)) / 2, np.nan)
    angles = np.maximum(_slope(x, far), _slope(x, -near))
    return middle, np.where(found, angles, np.inf)


def _slope(x: np.ndarray, edge: np.ndarray) -> np.ndarray:
    """Angles (n,) between edges (n, k) at x (k,) and the pad that meets their greatest; -inf: no edge."""
    touched = edge > edge.max(axis=1, keepdims=True) - _DEEP
    weight = touched / np.maximum(touched.sum(axis=1, keepdims=True), 1)
    y = np.where(touched, edge, 0.0)
    mean_x, mean_y = (weight * x).sum(axis=1, keepdims=True), (weight * y).sum(axis=1, keepdims=True)
    spread = (weight * (x - mean_x) ** 2).sum(axis=1)
    # A contact of a few millimetres has no slope that the image shows.
    rise = (weight * (x - mean_x) * (y - mean_y)).sum(axis=1) / (spread + _STEP**2)
    return np.arctan(np.abs(rise))


def _part_points(frame: RgbdFrame, workspace: Workspace) -> np.ndarray:
    """Places (n, 2) of the part's pixels, base frame, metres."""
    found = find_part_pixels(
        frame.depth, frame.intrinsics, frame.T_base_camera,
        table_z=workspace.table_z, region=workspace.region, min_height=workspace.min_height,
    )  # fmt: skip
    return found.points_base[:2, found.mask].T


def _height(view: PartView, workspace: Workspace, xy: np.ndarray) -> np.ndarray:
    """Heights (n,) of grasps at (n, 2), base frame, metres: half the part's height, the palm clear of it."""
    height = float(view.size[2])
    z = workspace.table_z + max(height / 2, height + PALM_CLEARANCE - PALM_HEIGHT)
    return np.maximum(z, workspace.lowest_grasp_z(xy))
