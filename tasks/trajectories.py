"""Attempts in ManiSkill's trajectory format, as its ``RecordEpisode`` writes this task."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from mani_skill.utils.io_utils import dump_json

from mskgrasp.core.files import require_space
from mskgrasp.core.geometry import Pose, quat_to_matrix
from tasks.scene.frames import to_world

ENV_ID = "GraspDisplacement-v1"
MAX_EPISODE_STEPS = 250
_KINEMATIC = 13  # position, quaternion, velocity, angular velocity


@dataclass(frozen=True, kw_only=True)
class Episode:
    """One attempt: a trajectory of one step.

    Attributes:
        part: Name of the part.
        grasp: (4,) the action: x, y, z, theta, base frame.
        depth: (h, w) float32 before the grasp, metres, 0 where invalid.
        T_base_obj: (2, 7) x y z qw qx qy qz of the part before and after; NaN if unknown.
        success: Whether the part was lifted.
        info: Further outcome, for the JSON file.
    """

    part: str
    grasp: np.ndarray
    depth: np.ndarray
    T_base_obj: np.ndarray
    success: bool
    info: dict[str, Any]


def write_trajectories(
    path: Path,
    episodes: Iterable[Episode],
    *,
    env_kwargs: dict[str, Any],
    intrinsics: np.ndarray,
    T_base_camera: Pose,
    description: str,
) -> int:
    """Write ``path`` (.h5) with a group ``traj_i`` for each episode, and the .json file beside it.

    Args:
        path: Must end in .h5.
        episodes: In this order.
        env_kwargs: Arguments with which ``gymnasium.make`` rebuilds the task.
        intrinsics: (3, 3) of the overhead camera, integer coordinates at a pixel's centre.
        T_base_camera: Pose of its optical frame.
        description: Origin of the data.

    Returns:
        Number of episodes written.

    Raises:
        OSError: The disk is nearly full or not writable.
    """
    camera = camera_parameters(intrinsics, T_base_camera)
    listed: list[dict[str, Any]] = []
    with h5py.File(path, "w") as file:
        for number, episode in enumerate(episodes):
            require_space(path)
            _write_group(file.create_group(f"traj_{number}", track_order=True), episode, camera)
            pose = [float(value) for value in episode.T_base_obj[0]]
            options = dict(parts=[episode.part], reconfigure=True, pose_base_obj=[pose])
            listed.append(
                dict(
                    episode_id=number,
                    episode_seed=0,
                    control_mode="grasp",
                    elapsed_steps=1,
                    reset_kwargs=dict(options=options, seed=0),
                    success=episode.success,
                    fail=not episode.success,
                    info=episode.info,
                )
            )
    env_info = dict(env_id=ENV_ID, env_kwargs=env_kwargs, max_episode_steps=MAX_EPISODE_STEPS)
    record = dict(
        env_info=env_info,
        commit_info=None,
        episodes=listed,
        source_type="simulated grasps",
        source_desc=description,
    )
    dump_json(path.with_suffix(".json"), record, indent=2)
    return len(listed)


def camera_parameters(intrinsics: np.ndarray, T_base_camera: Pose) -> dict[str, np.ndarray]:
    """ManiSkill's ``sensor_param`` of a camera, float32, in its world and its pixel convention."""
    # ManiSkill's image plane has a pixel's corner, not its centre, at integer coordinates.
    shifted = np.array(intrinsics, dtype=np.float64)
    shifted[:2, 2] += 0.5
    T_world_camera = np.eye(4)
    T_world_camera[:3, :3] = quat_to_matrix(np.asarray(T_base_camera.quat_wxyz, dtype=np.float64))
    T_world_camera[:3, 3] = to_world(np.asarray(T_base_camera.position, dtype=np.float64))
    to_opengl = np.diag([1.0, -1.0, -1.0, 1.0])
    return dict(
        extrinsic_cv=np.linalg.inv(T_world_camera)[:3].astype(np.float32),
        cam2world_gl=(T_world_camera @ to_opengl).astype(np.float32),
        intrinsic_cv=shifted.astype(np.float32),
    )


def _write_group(group: h5py.Group, episode: Episode, camera: dict[str, np.ndarray]) -> None:
    # The format has an observation after the last action; no image is taken then.
    depth = np.stack([episode.depth, np.zeros_like(episode.depth)])[..., None]
    group.create_dataset(
        "obs/sensor_data/overhead/depth", data=depth.astype(np.float32),
        chunks=(1, *depth.shape[1:]), compression="gzip", compression_opts=1, shuffle=True,
    )  # fmt: skip
    for name, value in camera.items():
        group.create_dataset(f"obs/sensor_param/overhead/{name}", data=np.stack([value, value]))
    poses = np.asarray(episode.T_base_obj, dtype=np.float32)
    group.create_dataset("obs/extra/part_pose", data=poses)
    group.create_dataset("actions", data=np.asarray(episode.grasp, dtype=np.float32)[None])
    flags = dict(terminated=True, truncated=False, success=episode.success, fail=not episode.success)
    for name, value in flags.items():
        group.create_dataset(name, data=np.array([value], dtype=bool))
    state = np.zeros((2, _KINEMATIC), np.float32)
    state[:, :3] = to_world(poses[:, :3].astype(np.float64))
    state[:, 3:7] = poses[:, 3:]
    group.create_dataset("env_states/actors/part", data=state)
    group.create_dataset("rewards", data=np.array([episode.success], dtype=np.float32))
