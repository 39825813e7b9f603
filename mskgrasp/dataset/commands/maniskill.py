"""Export of datasets as ManiSkill trajectories."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from mskgrasp.core.errors import BadDataset
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import FAILURES, pose_base_tcp
from mskgrasp.dataset.attempts import Attempts, ShardInfo, physics_of, u16_to_depth
from mskgrasp.dataset.export import Watch, check_export_path, renamed_at_the_end, same_settings
from mskgrasp.dataset.shards import list_shards, read_columns, read_shard


def export_maniskill(folder: Path, out: Path, watch: Watch = iter) -> int:
    """Write a dataset as ManiSkill trajectories: ``out`` (.h5) and the .json file beside it.

    An attempt is a trajectory of one step in control mode ``grasp`` of GraspDisplacement-v1; docs/dataset.md
    has the mapping. The part's pose afterwards is known only for successes, which are in the lifted hand.

    Returns:
        The number of attempts.

    Raises:
        BadDataset: A shard is damaged, or the shards do not belong together.
        UsageError: A file exists, or cannot be made.
    """
    # Imported here, because only this verb needs the simulator's conventions.
    from tasks.trajectories import Episode, write_trajectories

    files = check_export_path(folder, out, ".h5")
    paths = list_shards(folder)
    _, info = read_columns(paths[0], ("success",))
    size = read_columns(paths[0], ("depth",))[0]["depth"].shape[1:]

    lift_height = info.physics.get("lift_height")
    if not isinstance(lift_height, int | float):
        raise BadDataset(
            f"{paths[0]}: physics has no lift_height, without which the part's pose is not known"
        )

    def episodes() -> Iterator[Episode]:
        for path in watch(paths):
            attempts, own = read_shard(path)
            same_settings(path, own, [info])
            if attempts.depth.shape[1:] != size:
                raise BadDataset(f"{path}: depth images of another size than {size}; collect it again")
            # With errors of the arm the hand's true pose differs from the commanded one, and is not stored.
            after = _pose_after(attempts, np.nan if _has_arm_errors(own) else lift_height)
            for row in range(len(attempts)):
                success = bool(attempts.success[row])
                yield Episode(
                    part=own.part,
                    grasp=attempts.grasp[row],
                    depth=np.nan_to_num(u16_to_depth(attempts.depth[row])),
                    T_base_obj=np.stack([attempts.pose_base_obj[row], after[row]]),
                    success=success,
                    info=_outcome(attempts, own, row),
                )

    height = float(info.T_base_camera.position[2]) - info.table_z
    grasps = f"grasps chosen by planner {info.planner}" if info.planner else "random grasps"
    camera = dict(height=height, focal_px=float(info.intrinsics[0, 0]), n_pixels=int(size[0]))
    with renamed_at_the_end(out.parent, files) as temporary:
        return write_trajectories(
            temporary / out.name,
            episodes(),
            env_kwargs=dict(
                obs_mode="depth",
                control_mode="grasp",
                physics=physics_of(info),
                noise=dict(info.noise),
                camera=camera,
            ),
            intrinsics=info.intrinsics,
            T_base_camera=info.T_base_camera,
            description=f"{grasps}, of mskgrasp.collect, one a trajectory",
        )


def _has_arm_errors(info: ShardInfo) -> bool:
    return any(info.noise.get(name) for name in ("arm_position_std", "arm_angle_std"))


def _pose_after(attempts: Attempts, lift_height: float) -> np.ndarray:
    """Compute the part's poses (n, 7) after the lift, base frame; NaN for failures."""
    if not np.isfinite(lift_height):
        return np.full((len(attempts), 7), np.nan)
    lifted = attempts.grasp.astype(np.float64)
    lifted[:, 2] += lift_height
    after = pose_base_tcp(lifted) @ Pose.from_vector(attempts.pose_tcp_obj_after.astype(np.float64))
    return np.where(attempts.success[:, None], after.as_vector(), np.nan)


def _outcome(attempts: Attempts, info: ShardInfo, row: int) -> dict[str, Any]:
    known: dict[str, Any] = dict(part=info.part, family=info.family, part_hash=info.part_hash)
    known["failure"] = FAILURES[attempts.failure[row]]
    if attempts.success[row]:
        known["displacement"] = [float(value) for value in attempts.displacement[row]]
        known["tilt"] = float(attempts.tilt[row])
        known["width_after"] = float(attempts.width_after[row])
    return known
