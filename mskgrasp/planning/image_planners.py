"""Planners that need no model: centroid and short axis, and an antipodal pair of edges of the depth image."""

from __future__ import annotations

import cv2
import numpy as np
import torch

from hal.camera import RgbdFrame
from hal.cell import Workspace
from mskgrasp.core.errors import NoGraspFound
from mskgrasp.core.geometry import wrap_half_turn
from mskgrasp.core.grasp import MAX_OPENING, PAD_REACH, PALM_HEIGHT, Grasp, PartView
from mskgrasp.perception.part_detection import find_part_pixels
from mskgrasp.planning.proposal import ProposedGrasp, view_of
from mskgrasp.planning.refine import hand_room
from mskgrasp.planning.scoring import Scene

PALM_CLEARANCE = 0.005
"""Least distance of the palm from the top of the part, metres."""
FRICTION_CONE = float(np.arctan(0.5))
"""Greatest angle between the normal of an edge and the closing direction, radians: of a friction of 0.5."""
SPARE = 0.003
"""Least distance of each open pad from the part, metres."""
MOST_TRIED = 200
"""Pairs of edges, best first, for which the room of the open hand is checked."""
_STEP = 0.001
_DEEP = 0.002
"""What rises by more over the tips of the fingers counts no more, metres."""
_SMOOTH = 0.002
"""Standard deviation of the smoothing, metres: about a pixel of the overhead camera."""


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

    Edges are those of what rises over the tips of the fingers. Of pairs that the hand spans, whose normals
    point away from each other within the friction cone, that of least cost is taken: the greater angle
    between a normal and the line through both in units of the cone, plus the distance from the centroid in
    units of the part's radius of gyration.
    """

    def __init__(self, workspace: Workspace):
        self._workspace = workspace

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> ProposedGrasp:
        """Plan a grasp of the part in a frame; the generator is not used.

        Raises:
            NoPartFound: No part is detected.
            NoGraspFound: No edges within reach are opposite.
        """
        workspace = self._workspace
        view = view_of(frame, workspace)
        scene = Scene.of(frame, view, workspace.table_z, torch.device("cpu"))
        centroid = _part_points(frame, workspace).mean(axis=0)
        z = float(_height(view, workspace, centroid[None])[0])
        first, second, angle = opposite_edges(*edges(scene, z))
        middle, line = (first + second) / 2, second - first
        away = np.linalg.norm(middle - centroid, axis=1) / max(view.gyration_radius, 1e-3)
        order = np.argsort(angle / FRICTION_CONE + away, kind="stable")[:MOST_TRIED]
        grasps = np.column_stack(
            [middle, _height(view, workspace, middle), wrap_half_turn(np.arctan2(-line[:, 0], line[:, 1]))]
        )[order]
        free, between = hand_room(scene, grasps) if len(grasps) else (np.zeros(0, bool), np.zeros(0, bool))
        good = np.flatnonzero(free & between)
        if not len(good):
            raise NoGraspFound("no two opposite edges of the part have room for the hand; turn the part over")
        return ProposedGrasp(grasp=Grasp.from_vector(grasps[good[0]]))


def edges(scene: Scene, z: float) -> tuple[np.ndarray, np.ndarray]:
    """Find the edges that the pads of a hand at height ``z`` meet, base frame, metres.

    Returns:
        Points (n, 2) on them, base frame, and their normals (n, 2), which point away from the part.
    """
    view = scene.view
    n = int(np.ceil((float(view.size[:2].max()) + 0.02) * np.sqrt(2) / _STEP))
    centre = np.array([[*view.centre_base[:2], z, 0.0]])
    heights = scene.crop_of(centre, (n, n), _STEP)[0, 0].cpu().double().numpy()
    tip = max(z - scene.table_z - PAD_REACH, 0.0)
    over = cv2.GaussianBlur(np.clip(heights - tip, 0.0, _DEEP), (0, 0), _SMOOTH / _STEP)
    # Rows run against the base's y, columns along its x.
    down, right = np.gradient(over)
    steep = np.hypot(down, right)
    rows, columns = np.nonzero(steep > 0.5 * steep.max()) if steep.max() > 0 else (np.zeros(0, int),) * 2
    middle = (n - 1) / 2
    points = view.centre_base[:2] + _STEP * np.column_stack([columns - middle, middle - rows])
    normals = np.column_stack([-right[rows, columns], down[rows, columns]])
    return points, normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def opposite_edges(points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find pairs of edge points that the hand spans and whose normals are opposite within the friction cone.

    Args:
        points: (n, 2) metres.
        normals: (n, 2) unit vectors.

    Returns:
        The first and the second point (k, 2) of each pair, and the greater angle (k,) between a normal and
        the line through both, radians.
    """
    i, j = np.triu_indices(len(points), 1)
    line = points[j] - points[i]
    length = np.maximum(np.linalg.norm(line, axis=1), 1e-12)
    along = line / length[:, None]
    cosine = np.minimum(-(normals[i] * along).sum(axis=1), (normals[j] * along).sum(axis=1))
    kept = (cosine >= np.cos(FRICTION_CONE)) & (length <= MAX_OPENING - 2 * SPARE)
    return points[i][kept], points[j][kept], np.arccos(np.clip(cosine[kept], -1.0, 1.0))


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
