"""Simulation of a shard: attempts on one part, determined by the seed."""

from __future__ import annotations

import gc
from collections import Counter
from collections.abc import Generator, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch

from mskgrasp.core.errors import NoPartFound, TableTooHigh
from mskgrasp.core.geometry import Pose, pose_distance
from mskgrasp.core.grasp import HAND_GEOMETRY, MAX_DISPLACEMENT, sample_grasps
from mskgrasp.core.seeds import scene_seeds
from mskgrasp.core.settings import REGION, TABLE_Z, ExecutionNoise, Overhead, Physics
from mskgrasp.dataset import Attempts, ShardInfo, depth_to_u16, shard_path, u16_to_depth, write_shard
from mskgrasp.dataset.attempts import COLUMNS
from mskgrasp.dataset.labels import ShardLabels
from mskgrasp.perception.part_detection import view_part
from mskgrasp.simulation.planned_grasps import PlannedGrasps
from mskgrasp.simulation.shard_task import ShardTask
from mskgrasp.simulation.versions import versions
from tasks import GraspDisplacementEnv
from tasks.attempt.outcome import MAX_PENETRATION, MAX_SPEED
from tasks.scene.renderer import render_backend

FIELDS = (
    "success", "failure", "displacement", "tilt", "width_after", "relative_speed",
    "pose_base_obj", "pose_tcp_obj_before", "pose_tcp_obj_after",
)  # fmt: skip
SAME_M, SAME_RAD = 5e-4, 5e-3
"""A part this near to its stored pose is in that pose, which was measured once it was at rest."""
MOST_REDRAWS = 4
"""Greatest number of times that an attempt whose part was not at rest is drawn again."""


class Simulator:
    """The environment of one worker, built once and refilled with part after part."""

    def __init__(
        self,
        physics: Physics,
        camera: Overhead,
        noise: ExecutionNoise,
        *,
        planned_by: Path | None = None,
    ):
        """Take the settings.

        Args:
            physics: Of the cell.
            camera: The overhead camera.
            noise: Errors of the cell.
            planned_by: Folder of the model whose planner chooses the grasps; None: they are random.

        Raises:
            MissingModel: There is no model in the folder.
            BadModel: It is damaged, or predicts no variance.
        """
        self._physics = physics
        self._camera = camera
        self._noise = noise
        self._planned = None if planned_by is None else PlannedGrasps(planned_by)
        self._env: gymnasium.Env | None = None

    def load(self, folder: str) -> GraspDisplacementEnv:
        """Build a fresh scene with the part, free of state that earlier shards left in PhysX."""
        if self._env is None:
            self._env = gymnasium.make(
                "GraspDisplacement-v1",
                parts=[folder],
                obs_mode="none",
                physics=self._physics.model_dump(),
                camera=self._camera.model_dump(),
                noise=self._noise.model_dump(),
                render_backend=render_backend(),
                sim_backend="physx_cpu",
            )
            # ManiSkill collects garbage at every new scene; the modules loaded by now need no scan.
            gc.collect()
            gc.freeze()
        else:
            self._env.reset(seed=0, options=dict(parts=[folder], reconfigure=True))
        env = self._env.unwrapped
        assert isinstance(env, GraspDisplacementEnv)
        return env

    def write(self, task: ShardTask, dataset: Path) -> Iterator[int]:
        """Make a shard and write it into a dataset's folder; yield as `run`."""
        attempts, info = yield from self.run(task)
        write_shard(shard_path(dataset, task.part, task.index), attempts, info)

    def run(self, task: ShardTask) -> Generator[int, None, tuple[Attempts, ShardInfo]]:
        """Make the attempts of a shard and return them.

        Yields:
            1 after each success, 0 after a failure and -1 after a discarded attempt.
        """
        env = self.load(task.folder)
        part = env.parts[0]
        rows: list[dict[str, np.ndarray]] = []
        discarded: Counter[str] = Counter()
        redrawn = 0
        for attempt in range(task.first, task.first + task.n):
            draw = 0
            row, reason = _try(env, task, attempt, draw, self._planned)
            while reason == "unsettled" and draw < MOST_REDRAWS:
                draw += 1
                row, reason = _try(env, task, attempt, draw, self._planned)
            redrawn += draw
            if reason:
                discarded[reason] += 1
                yield -1
                continue
            rows.append(row)
            yield int(row["success"])
        attempts = _stack(rows, (self._camera.n_pixels, self._camera.n_pixels))
        info = ShardInfo(
            part=part.name,
            part_hash=part.content_hash,
            family=part.family,
            index=task.index,
            seed=task.seed,
            intrinsics=env.intrinsics,
            T_base_camera=env.T_base_camera,
            table_z=TABLE_Z,
            region=REGION,
            physics=self._physics.model_dump(),
            noise=self._noise.model_dump(mode="json"),
            versions=versions(),
            discarded=dict(discarded),
            redrawn=redrawn,
            toppled=env.standing[0].toppled,
            fidelity=env.fidelity,
            hand=HAND_GEOMETRY,
            planner="" if self._planned is None else self._planned.digest,
        )
        return attempts, info

    def restore(self, task: ShardTask, labels: ShardLabels, dataset: Path) -> Iterator[int]:
        """Write a shard whose labels are known: its scenes are rendered, no grasp is tried; yield as `run`.

        A label holds for the scene that it was made in. Where that comes out differently, because a resting
        pose stands on one machine alone, the attempt is discarded.

        Raises:
            UsageError: The labels are not those of this task.
        """
        task.check_labels(labels)
        env = self.load(task.folder)
        columns, info = labels.columns, labels.info
        numbers = columns["attempt"]
        images = np.zeros((len(numbers), self._camera.n_pixels, self._camera.n_pixels), np.uint16)
        same = np.ones(len(numbers), dtype=bool)
        for row, (attempt, draw) in enumerate(zip(numbers.tolist(), columns["draw"].tolist(), strict=True)):
            images[row] = capture_scene(env, task.part, task.seed, attempt, draw)[0]
            same[row] = lies_as(env, columns["pose_base_obj"][row])
            yield int(columns["success"][row]) if same[row] else -1
        for _ in range(task.n - len(numbers)):
            yield -1
        if not same.all():
            # Labels that were restored before may count such attempts already.
            discarded = Counter(info.discarded) + Counter(lies_otherwise=int((~same).sum()))
            info = replace(info, discarded=dict(discarded))
        attempts = Attempts(depth=images[same], **{name: values[same] for name, values in columns.items()})
        write_shard(shard_path(dataset, task.part, task.index), attempts, info)

    def close(self) -> None:
        """Free the simulation."""
        if self._env is not None:
            self._env.close()


def _try(
    env: GraspDisplacementEnv, task: ShardTask, attempt: int, draw: int, planned: PlannedGrasps | None
) -> tuple[dict[str, np.ndarray], str]:
    """One attempt as a row of the shard, and the reason why it is not one; empty where it is."""
    try:
        depth, grasp = draw_attempt(env, task.part, task.seed, attempt, draw, planned)
    except TableTooHigh:
        return {}, "table_too_high"
    if grasp is None:
        return {}, "part_not_seen"
    outcome = env.try_grasp(torch.as_tensor(grasp, device=env.device))
    row = {name: outcome[name][0].cpu().numpy() for name in FIELDS}
    row |= dict(depth=depth, grasp=grasp[0], attempt=np.array(attempt), draw=np.array(draw))
    row |= env.hand_settings()
    return row, discard_reason(outcome, row)


def draw_attempt(
    env: GraspDisplacementEnv,
    part: str,
    seed: int,
    attempt: int,
    draw: int = 0,
    planned: PlannedGrasps | None = None,
) -> tuple[np.ndarray, np.ndarray | None]:
    """Place the part as determined by seed and attempt number, take a depth image and choose a grasp.

    Args:
        env: Holds the part.
        part: Name of the part.
        seed: Seed of the run.
        attempt: Number of the attempt among those of the part.
        draw: Number of times that the attempt was drawn before, with a part that was not at rest.
        planned: Chooses the grasp; None: it is drawn at random.

    Returns:
        The depth image (h, w), uint16 in 0.1 mm, and the grasp (1, 4), float32, base frame; None where the
        camera does not see the part.

    Raises:
        TableTooHigh: The table is seen too high for a planner.
    """
    depth, grasp_seed = capture_scene(env, part, seed, attempt, draw)
    rng = np.random.default_rng(grasp_seed)
    if planned is not None:
        try:
            chosen = planned.choose(u16_to_depth(depth), env.intrinsics, env.T_base_camera, rng)
        except NoPartFound:
            return depth, None
        return depth, chosen[None].astype(np.float32)
    try:
        view = view_part(
            u16_to_depth(depth),
            env.intrinsics,
            env.T_base_camera,
            table_z=TABLE_Z,
            region=REGION,
        )
    except NoPartFound:
        return depth, None
    return depth, sample_grasps(view, 1, rng).astype(np.float32)


def capture_scene(
    env: GraspDisplacementEnv, part: str, seed: int, attempt: int, draw: int
) -> tuple[np.ndarray, int]:
    """Place the part of an attempt; returns its depth image, as `draw_attempt` does, and its grasp's seed."""
    episode_seed, grasp_seed = scene_seeds(seed, part, attempt, draw)
    env.begin_episode(episode_seed)
    return depth_to_u16(env.capture_depth()[0].cpu().numpy()), grasp_seed


def lies_as(env: GraspDisplacementEnv, pose_base_obj: np.ndarray) -> bool:
    """Whether the part of an episode that has just begun lies as in a stored pose (7,)."""
    drawn = Pose.from_vector(env.part_pose().as_vector()[0].cpu().numpy().astype(np.float64))
    moved, turned = pose_distance(drawn, Pose.from_vector(np.asarray(pose_base_obj, np.float64)))
    return moved <= SAME_M and turned <= SAME_RAD


def discard_reason(outcome: dict[str, torch.Tensor], row: dict[str, np.ndarray]) -> str:
    """Reason why an attempt is not a label; empty where it is one."""
    if not bool(outcome["executable"][0]):
        return "unreachable"
    if not bool(outcome["settled"][0]):
        return "unsettled"
    if not all(np.isfinite(row[name]).all() for name in FIELDS if name.startswith("pose")):
        return "not_finite"
    penetration = float(outcome["penetration"][0])
    if np.isnan(penetration):
        return "overlap_unknown"
    if penetration > MAX_PENETRATION:
        return "penetrated"
    if float(outcome["fastest"][0]) > MAX_SPEED:
        return "too_fast"
    if row["success"] and np.linalg.norm(row["displacement"][:3]) > MAX_DISPLACEMENT:
        return "moved_too_far"
    return ""


def _stack(rows: list[dict[str, np.ndarray]], shape: tuple[int, int]) -> Attempts:
    arrays: dict[str, Any] = {}
    for name, column in COLUMNS.items():
        rest = shape if column.shape is None else column.shape
        values = np.stack([row[name] for row in rows]) if rows else np.zeros((0, *rest))
        arrays[name] = values.astype(column.dtype)
    return Attempts(**arrays)
