"""Boxes on a table: depth images by ray casting and grasps whose outcome follows from plane geometry."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.core.geometry import Pose, quat_about_z, quat_multiply, quat_to_matrix, wrap_half_turn
from mskgrasp.core.grasp import (
    FAILURES,
    MAX_OPENING,
    PAD_REACH,
    PartView,
    object_displacement,
    pose_base_tcp,
    sample_grasps,
)
from mskgrasp.dataset import Attempts, ShardInfo, depth_to_u16, shard_path, write_shard
from mskgrasp.perception.part_detection import view_part

TABLE_Z = 0.0
REGION = (0.335, 0.575, -0.12, 0.12)
INTRINSICS = np.array([[365.5, 0.0, 79.5], [0.0, 365.5, 79.5], [0.0, 0.0, 1.0]])
N_PIXELS = 160
# The camera looks straight down from 0.8 m, its image x along the base's -y.
OVERHEAD = Pose.from_matrix(
    np.array([[0.0, -1.0, 0.0, 0.455], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.8], [0.0, 0.0, 0.0, 1.0]])
)

# Tilted by 20 degrees away from straight down, moved so that it still sees the region.
TILTED = Pose(
    position=np.array([0.455, -0.27, 0.75]),
    quat_wxyz=quat_multiply(np.array([np.cos(0.175), np.sin(0.175), 0.0, 0.0]), OVERHEAD.quat_wxyz),
)


@dataclass(frozen=True, kw_only=True)
class Box:
    """A box that lies on the table: x, y of its centre, yaw, and its length, width and height."""

    x: float
    y: float
    yaw: float
    size: tuple[float, float, float]

    @property
    def T_base_obj(self) -> Pose:
        position = np.array([self.x, self.y, TABLE_Z + self.size[2] / 2])
        return Pose(position=position, quat_wxyz=quat_about_z(np.array(self.yaw)))


def render(
    boxes: list[Box],
    T_base_camera: Pose = OVERHEAD,
    intrinsics: np.ndarray = INTRINSICS,
    shape: tuple[int, int] = (N_PIXELS, N_PIXELS),
) -> np.ndarray:
    """Depth (h, w) float32 metres along the optical axis of boxes on a table, by ray casting."""
    rows, columns = np.mgrid[: shape[0], : shape[1]].astype(float)
    pixels = np.stack([columns, rows, np.ones_like(rows)], axis=-1)
    rays = pixels @ np.linalg.inv(intrinsics).T @ quat_to_matrix(T_base_camera.quat_wxyz).T
    depth = (TABLE_Z - T_base_camera.position[2]) / rays[..., 2]
    for box in boxes:
        T_obj_base = box.T_base_obj.inverse()
        half = np.array(box.size) / 2
        # Only rays that end near the box can meet it: what stands on the table leans away by less.
        radius = 1.5 * np.linalg.norm(half) + box.size[2]
        ends = T_base_camera.position[:2] + rays[..., :2] * depth[..., None]
        near = np.linalg.norm(ends - [box.x, box.y], axis=-1) < radius
        origin = T_obj_base.apply(T_base_camera.position)
        direction = rays[near] @ quat_to_matrix(T_obj_base.quat_wxyz).T
        with np.errstate(divide="ignore", invalid="ignore"):
            first, second = (-half - origin) / direction, (half - origin) / direction
        enters = np.minimum(first, second).max(axis=-1)
        leaves = np.maximum(first, second).min(axis=-1)
        hit = (enters <= leaves) & (enters < depth[near])
        depth[near] = np.where(hit, enters, depth[near])
    return depth.astype(np.float32)


def frame(boxes: list[Box], T_base_camera: Pose = OVERHEAD) -> RgbdFrame:
    """What a perfect camera would capture, by default from straight above."""
    return RgbdFrame(
        colour=np.full((N_PIXELS, N_PIXELS, 3), 128, np.uint8),
        depth=render(boxes, T_base_camera),
        intrinsics=INTRINSICS,
        T_base_camera=T_base_camera,
        timestamp_s=0.0,
        serial="synthetic",
    )


def view(depth: np.ndarray) -> PartView:
    return view_part(depth, INTRINSICS, OVERHEAD, table_z=TABLE_Z, region=REGION)


def attempt(box: Box, grasp: np.ndarray) -> tuple[str, np.ndarray]:
    """Closes a jaw on a box in the plane.

    The jaw aligns the box with the nearest pair of faces and centres it along the closing direction. It
    misses what it does not reach, collides with what it stands on, and slips where the faces are too
    oblique.

    Returns:
        failure, and the displacement (4,) of the box in the grasp frame (zeros if it failed).
    """
    offset = np.array([box.x, box.y]) - grasp[:2]
    cos, sin = np.cos(grasp[3]), np.sin(grasp[3])
    centre = np.array([cos * offset[0] + sin * offset[1], -sin * offset[0] + cos * offset[1]])
    quarter = np.pi / 2
    turn = -((box.yaw - grasp[3] + quarter / 2) % quarter - quarter / 2)
    aligned = wrap_half_turn(box.yaw + turn - grasp[3])
    crossed = abs(abs(float(aligned)) - quarter) < 1e-6
    along, across = (box.size[1], box.size[0]) if crossed else (box.size[0], box.size[1])
    spread = abs(np.cos(turn)) * across + abs(np.sin(turn)) * along
    failed = np.zeros(4)
    if grasp[2] - PAD_REACH > TABLE_Z + box.size[2]:
        return "missed", failed
    if abs(centre[1]) + spread / 2 > MAX_OPENING / 2:
        return "collided", failed
    if abs(centre[0]) > along / 2:
        return "missed", failed
    if abs(turn) > np.deg2rad(30):
        return "slipped", failed
    # The box turns about the point where the jaw's centre line meets it, then is centred.
    turned_x = centre[0] * np.cos(turn)
    return "none", np.array([turned_x - centre[0], -centre[1], 0.0, turn])


def random_box(rng: np.random.Generator, size: tuple[float, float, float]) -> Box:
    x_min, x_max, y_min, y_max = REGION
    return Box(
        x=float(rng.uniform(x_min + 0.06, x_max - 0.06)),
        y=float(rng.uniform(y_min + 0.06, y_max - 0.06)),
        yaw=float(rng.uniform(-np.pi / 2, np.pi / 2)),
        size=size,
    )


def random_attempts(n: int, size: tuple[float, float, float], rng: np.random.Generator) -> Attempts:
    """n attempts at a box of one size in random places, with consistent poses and labels."""
    depth, grasps, failures, displacements, poses = [], [], [], [], []
    for _ in range(n):
        box = random_box(rng, size)
        image = render([box])
        grasp = sample_grasps(view(image), 1, rng)[0]
        failure, displacement = attempt(box, grasp)
        depth.append(depth_to_u16(image))
        grasps.append(grasp)
        failures.append(FAILURES.index(failure))
        displacements.append(displacement)
        poses.append(box.T_base_obj.as_vector())
    grasp = np.array(grasps, dtype=np.float32)
    success = np.array(failures) == 0
    T_base_obj = Pose.from_vector(np.array(poses))
    before = pose_base_tcp(grasp.astype(np.float64)).inverse() @ T_base_obj
    after = displaced(before, np.array(displacements))
    measured, tilt = object_displacement(before, after)
    return Attempts(
        depth=np.array(depth),
        grasp=grasp,
        success=success,
        failure=np.array(failures, dtype=np.uint8),
        displacement=np.where(success[:, None], measured, np.nan).astype(np.float32),
        tilt=np.where(success, tilt, np.nan).astype(np.float32),
        width_after=np.where(success, min(size[:2]), 0.0).astype(np.float32),
        relative_speed=np.where(success, 1e-3, np.nan).astype(np.float32),
        pose_base_obj=T_base_obj.as_vector().astype(np.float32),
        pose_tcp_obj_before=before.as_vector().astype(np.float32),
        pose_tcp_obj_after=after.as_vector().astype(np.float32),
        attempt=np.arange(n, dtype=np.int32),
        draw=np.zeros(n, np.int32),
        finger_force=np.full(n, 30.0, np.float32),
        friction_pad_part=np.full(n, 0.5, np.float32),
    )


def displaced(T_tcp_obj: Pose, displacement: np.ndarray) -> Pose:
    """Moves parts in the hand: by dx, dy, dz and a turn about the grasp frame's z, their origin the pivot."""
    flip = np.array([0.0, 1.0, 0.0, 0.0])
    turn = quat_multiply(quat_multiply(flip, quat_about_z(displacement[..., 3])), -flip)
    moved = displacement[..., :3] * np.array([1.0, -1.0, -1.0])
    return Pose(
        position=T_tcp_obj.position + moved,
        quat_wxyz=quat_multiply(np.broadcast_to(turn, T_tcp_obj.quat_wxyz.shape), T_tcp_obj.quat_wxyz),
    )


def info(part: str, index: int = 0, seed: int = 0) -> ShardInfo:
    return ShardInfo(
        part=part,
        part_hash="0" * 16,
        family="box",
        index=index,
        seed=seed,
        intrinsics=INTRINSICS,
        T_base_camera=OVERHEAD,
        table_z=TABLE_Z,
        region=REGION,
        physics={"friction": 0.5},
        versions={"synthetic": "1"},
        discarded={"unsettled": 1},
    )


def write_dataset(folder: Path, *, n_parts: int, n_attempts: int, seed: int) -> Path:
    """A dataset of boxes of random sizes, a shard each."""
    rng = np.random.default_rng(seed)
    for k in range(n_parts):
        size = (
            float(rng.uniform(0.03, 0.08)),
            float(rng.uniform(0.015, 0.035)),
            float(rng.uniform(0.02, 0.04)),
        )
        attempts = random_attempts(n_attempts, size, rng)
        write_shard(shard_path(folder, f"box_{k}", 0), attempts, info(f"box_{k}", seed=k))
    return folder
