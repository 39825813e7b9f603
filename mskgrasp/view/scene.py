"""Parts, hands, arms, grasps and depth images as nodes of the page's scene."""

from __future__ import annotations

import numpy as np
import trimesh
from matplotlib import colormaps
from viser import FrameHandle, MeshHandle, SceneApi, SceneNodeHandle

from mskgrasp.core.geometry import Pose, quat_from_matrix
from mskgrasp.core.grasp import MAX_OPENING, Grasp, pose_base_grasp
from mskgrasp.core.palette import BLUE, FAINT
from mskgrasp.core.panda_body import Links
from mskgrasp.core.panda_kinematics import joint_frames
from mskgrasp.core.settings import Region
from mskgrasp.parts import Part
from mskgrasp.parts.hulls import hull_corners
from mskgrasp.reports.hand_boxes import hand_boxes

Colour = tuple[int, int, int]


def rgb(colour: str) -> Colour:
    """Red, green and blue, 0 to 255, of a colour of `mskgrasp.core.palette`."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


STEEL: Colour = (176, 180, 188)
"""Parts as they are."""
HAND = rgb(BLUE)
"""The hand."""
CLOSING = 0.012
"""Length of the drawn line along which a candidate closes, metres: the whole opening would hide the part."""
LINES = 100
"""Candidates that are drawn as lines: thousands of lines take a browser without a GPU 70 ms."""
TABLE_POINTS = 2000
"""Greatest number of points of the table that are drawn."""
AROUND = 0.06
"""Distance from the region up to which a depth image is drawn, metres."""
TABLE_MARGIN = 0.003
"""Points up to this height above the table are drawn as its own, metres."""
_TCP_FRAME = 7


def colours_of(qualities: np.ndarray) -> np.ndarray:
    """Colours (n, 3), uint8, of qualities (n,) between 0 and 1, as in the figures of plans; NaN is grey."""
    known = np.isfinite(qualities)
    colours = np.tile(np.array(rgb(FAINT), np.uint8), (len(qualities), 1))
    colours[known] = colormaps["viridis"](qualities[known], bytes=True)[:, :3]
    return colours


def place(node: SceneNodeHandle, pose: Pose) -> None:
    """Put a node at a pose (single) in its parent's frame."""
    node.position = np.asarray(pose.position, dtype=np.float64)
    node.wxyz = np.asarray(pose.quat_wxyz, dtype=np.float64)


def part_mesh(part: Part) -> trimesh.Trimesh:
    """The visual mesh of a part, obj frame, metres."""
    mesh = trimesh.load_mesh(part.mesh_path, process=False)
    assert isinstance(mesh, trimesh.Trimesh)
    return mesh


def add_part(
    scene: SceneApi,
    name: str,
    mesh: trimesh.Trimesh,
    pose: Pose | None = None,
    *,
    colour: Colour = STEEL,
    opacity: float | None = None,
) -> MeshHandle:
    """Add a part's mesh, solid or as a ghost."""
    node = scene.add_mesh_simple(
        name, np.asarray(mesh.vertices), np.asarray(mesh.faces), color=colour, opacity=opacity,
        flat_shading=True, side="double", cast_shadow=opacity is None, receive_shadow=False,
    )  # fmt: skip
    if pose is not None:
        place(node, pose)
    return node


def add_hulls(scene: SceneApi, name: str, part: Part) -> None:
    """Add the collision hulls of a part below a node, each in a colour of its own."""
    corners = hull_corners(part)
    palette = colormaps["tab20"](np.arange(len(corners)) % 20, bytes=True)
    for number, (points, colour) in enumerate(zip(corners, palette[:, :3].tolist(), strict=True)):
        hull = trimesh.convex.convex_hull(points)
        add_part(scene, f"{name}/{number}", hull, colour=(colour[0], colour[1], colour[2]), opacity=0.6)


def add_cloud(
    scene: SceneApi, name: str, points: np.ndarray, colours: np.ndarray | Colour, pitch: float
) -> None:
    """Add points (n, 3), metres, with colours (n, 3), that leave gaps at a distance of neighbours, metres."""
    scene.add_point_cloud(
        name, points.astype(np.float32), np.asarray(colours), point_size=0.6 * pitch, point_shading="flat",
        precision="float32",
    )  # fmt: skip


def drawn_points(points: np.ndarray, region: Region, table_z: float) -> np.ndarray:
    """Which points (n, 3), base frame, to draw: near the region, all above the table, some of the table."""
    near = near_region(points, region)
    flat = np.flatnonzero(near & (points[:, 2] < table_z + TABLE_MARGIN))
    if len(flat) > TABLE_POINTS:
        left_out = np.random.default_rng(0).choice(flat, len(flat) - TABLE_POINTS, replace=False)
        near[left_out] = False
    return near


def near_region(points: np.ndarray, region: Region) -> np.ndarray:
    """Whether points (n, 3), base frame, lie within `AROUND` of a region; False where not finite."""
    x_min, x_max, y_min, y_max = region
    low, high = np.array([x_min, y_min]) - AROUND, np.array([x_max, y_max]) + AROUND
    with np.errstate(invalid="ignore"):
        return ((points[:, :2] >= low) & (points[:, :2] <= high)).all(axis=1) & np.isfinite(points[:, 2])


def add_region(scene: SceneApi, name: str, region: Region, table_z: float) -> None:
    """Outline the region where parts lie, at the height of the table, metres."""
    x_min, x_max, y_min, y_max = region
    corners = np.array([[x_min, y_min], [x_max, y_min], [x_max, y_max], [x_min, y_max]])
    points = np.column_stack([corners, np.full(4, table_z)])
    sides = np.stack([points, np.roll(points, -1, axis=0)], axis=1)
    scene.add_line_segments(name, sides, rgb(FAINT), thickness=1.5, thickness_units="screen")


def closing_lines(grasps: Grasp) -> np.ndarray:
    """Ends (n, 2, 3) of lines through n grasps along the direction in which they close, base frame."""
    ends = np.array([[0.0, -CLOSING / 2, 0.0], [0.0, CLOSING / 2, 0.0]])
    vectors = grasps.as_vector()
    return np.stack([pose_base_grasp(vectors).apply(end) for end in ends], axis=1)


def add_candidates(scene: SceneApi, name: str, grasps: Grasp, qualities: np.ndarray) -> None:
    """Add n grasps as points coloured by their qualities (n,), and the `LINES` best as lines, too."""
    scene.add_frame(name, show_axes=False)
    colours = colours_of(qualities)
    add_cloud(scene, f"{name}/points", grasps.position, colours, CLOSING / 6)
    # Of a planner that predicts none, which leaves NaN, any.
    best = np.argsort(-np.nan_to_num(qualities), kind="stable")[:LINES]
    add_closing_lines(scene, f"{name}/lines", grasps[best], colours[best])


def add_closing_lines(scene: SceneApi, name: str, grasps: Grasp, colours: np.ndarray) -> None:
    """Add n grasps as one node of short lines, with colours (n, 3)."""
    lines = closing_lines(grasps)
    pairs = np.repeat(colours[:, None], 2, axis=1)
    scene.add_line_segments(name, lines, pairs, thickness=2.0, thickness_units="screen")


class HandNode:
    """The hand: two fingers and a palm at the TCP.

    Args:
        scene: The scene.
        name: Of the node.
        opacity: None: solid.
    """

    def __init__(self, scene: SceneApi, name: str, opacity: float | None = None):
        self.node: FrameHandle = scene.add_frame(name, show_axes=False)
        left, right, palm = hand_boxes(0.0)
        self._fingers = [
            add_part(scene, f"{name}/{side}", box, colour=HAND, opacity=opacity)
            for side, box in (("left", left), ("right", right))
        ]
        add_part(scene, f"{name}/palm", palm, colour=HAND, opacity=opacity)

    def place(self, T_base_tcp: Pose, width: float = MAX_OPENING) -> None:
        """Put the hand at a pose, its pads ``width`` metres apart."""
        # Its boxes are those of the grasp frame, which is the TCP's turned by half a turn about x.
        place(self.node, T_base_tcp @ Pose(position=np.zeros(3), quat_wxyz=np.array([0.0, 1.0, 0.0, 0.0])))
        for finger, side in zip(self._fingers, (-1, 1), strict=True):
            finger.position = np.array([0.0, side * width / 2, 0.0])


class ArmNode:
    """An arm with its hand; the capsules of its links where they are known.

    Args:
        scene: The scene.
        name: Of the node.
        links: Outline of the arm; None: the hand alone is drawn.
    """

    def __init__(self, scene: SceneApi, name: str, links: Links | None):
        self.node = scene.add_frame(name, show_axes=False)
        self._hand = HandNode(scene, f"{name}/hand")
        self._frames: list[FrameHandle] = []
        if links is None:
            return
        self._frames = [scene.add_frame(f"{name}/{i}", show_axes=False) for i in range(_TCP_FRAME + 1)]
        for number, one in enumerate(links.capsules):
            if one.name == "fingers":  # drawn as a part of the hand, as far apart as they are
                continue
            ends = np.array(one.ends)
            axis = ends[1] - ends[0]
            length = float(np.linalg.norm(axis))
            capsule = trimesh.creation.capsule(length, one.radius, count=[12, 12])
            turn = np.eye(4) if length == 0 else np.array(trimesh.geometry.align_vectors([0, 0, 1], axis))
            # Its origin is its first end or its middle, depending on the version of trimesh.
            capsule.apply_translation(-capsule.bounds.mean(axis=0))
            pose = Pose(position=ends.mean(axis=0), quat_wxyz=quat_from_matrix(turn[:3, :3]))
            add_part(scene, f"{name}/{one.frame}/{number}", capsule, pose, colour=(222, 225, 230))

    def place(self, joints: np.ndarray, T_base_tcp: Pose, width: float) -> None:
        """Put the arm at joints (7,), radians, its hand at a pose with the pads ``width`` metres apart."""
        self._hand.place(T_base_tcp, width)
        if self._frames:
            for node, frame in zip(self._frames, joint_frames(np.asarray(joints, np.float64)), strict=True):
                place(node, Pose.from_matrix(frame))


def add_shift(
    scene: SceneApi, name: str, start: Pose, shift: np.ndarray, covariance: np.ndarray, colour: Colour
) -> None:
    """Add an arrow of a shift, and the ellipsoid of twice the standard deviations of its end.

    Args:
        scene: The scene.
        name: Of the node.
        start: Where the arrow begins; shift and covariance are along its axes.
        shift: (3,) metres.
        covariance: (3, 3) square metres; NaN: not known, and no ellipsoid.
        colour: Of both.
    """
    node = scene.add_frame(name, show_axes=False)
    place(node, start)
    length = float(np.linalg.norm(shift))
    if length > 0:
        arrow = np.array([[np.zeros(3), shift]])
        radius = min(1e-3, 0.1 * length)
        scene.add_arrows(
            f"{name}/arrow", arrow, colour, shaft_radius=radius, head_radius=2 * radius,
            head_length=4 * radius,
        )  # fmt: skip
    if not np.isfinite(covariance).all():
        return
    variances, axes = np.linalg.eigh(covariance)
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    radii = np.maximum(2 * np.sqrt(np.maximum(variances, 0.0)), 1e-4)
    ellipsoid = scene.add_icosphere(
        f"{name}/ellipsoid", 1.0, color=colour, opacity=0.4, scale=tuple(radii.tolist()), cast_shadow=False,
        receive_shadow=False,
    )  # fmt: skip
    place(ellipsoid, Pose(position=np.asarray(shift), quat_wxyz=quat_from_matrix(axes)))
