"""The conversion between ManiSkill's world and the robot's base, and between camera conventions."""

from __future__ import annotations

from functools import cache

import numpy as np
import sapien
import torch
from mani_skill.utils.structs import Actor, Link

from mskgrasp.core.geometry import Array, Pose
from tasks.scene.arrays import Arrays, arrays_for

BASE_IN_WORLD = (-0.615, 0.0, 0.0)
"""Position of the Panda in ManiSkill's tabletop tasks, metres; the table's top is at z = 0 of the world."""
_OFFSET = np.array(BASE_IN_WORLD, np.float32)


def to_world(position_base: Array) -> Array:
    """Positions (..., 3) of the base frame in ManiSkill's world."""
    return position_base + _offset(position_base)


def to_base(position_world: Array) -> Array:
    """Positions (..., 3) of ManiSkill's world in the base frame."""
    return position_world - _offset(position_world)


def _offset(like: Array) -> Array:
    if isinstance(like, torch.Tensor):
        return _offset_tensor(like.dtype, like.device)
    return np.asarray(BASE_IN_WORLD)


@cache
def _offset_tensor(dtype: torch.dtype, device: torch.device) -> torch.Tensor:
    return torch.tensor(BASE_IN_WORLD, dtype=dtype, device=device)


def own_pose(body: Actor | Link, arrays: Arrays) -> Pose:
    """`base_pose` of the kind of array that the simulation computes with."""
    if body.scene.gpu_sim_enabled:
        pose = body.pose
        return Pose(position=to_base(pose.p), quat_wxyz=pose.q)
    # One sub-scene: the same numbers as ManiSkill's, without its four tensor operations a body.
    one = body._objs[0]
    single = one.pose if isinstance(one, sapien.Entity) else one.entity_pose
    return Pose(position=arrays.of(single.p - _OFFSET)[None], quat_wxyz=arrays.of(single.q)[None])


def base_pose(body: Actor | Link) -> Pose:
    """Poses of a body of every sub-scene in the base frame: positions (n, 3), quaternions (n, 4); tensors."""
    pose = own_pose(body, arrays_for(body.scene))
    return Pose(position=torch.as_tensor(pose.position), quat_wxyz=torch.as_tensor(pose.quat_wxyz))


def sapien_camera_pose(T_base_camera: Pose) -> sapien.Pose:
    """The world pose that SAPIEN wants (x forward, y left, z up) of an optical frame in the base."""
    optical = T_base_camera.as_matrix()
    matrix = np.eye(4)
    matrix[:3, 0] = optical[:3, 2]
    matrix[:3, 1] = -optical[:3, 0]
    matrix[:3, 2] = -optical[:3, 1]
    matrix[:3, 3] = to_world(optical[:3, 3])
    return sapien.Pose(matrix)
