"""A toy engine with the calls of ManiSkill that an attempt makes where PhysX runs on a GPU.

Several sub-scenes need a GPU. Here hands follow their drives, and blocks are carried or not, in torch on the
CPU: enough to see that what is computed for one sub-scene does not depend on its neighbours.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from mskgrasp.core.geometry import quat_from_matrix
from mskgrasp.core.panda_kinematics import HOME, forward
from mskgrasp.core.settings import Physics
from tasks.attempt.attempt import Attempt
from tasks.robot.contacts import HandContacts
from tasks.robot.motion import PandaMotion
from tasks.robot.panda import HAND_LINKS
from tasks.scene.frames import BASE_IN_WORLD

SIZE = (0.04, 0.02, 0.03)
GRIP_N = 20.0


class ToyScene:
    """Takes the place of a ``ManiSkillScene``.

    Args:
        blocks: (n, 3) middles of blocks of `SIZE`, base frame, metres.
        between: (n,) half the distance of the pads that a block stops; 0 where nothing is between them.
        carried: (n,) share of the hand's way that a block between closed pads is carried.
        struck: (n,) N on a finger that is lower than 6 cm.
    """

    gpu_sim_enabled = True
    device = torch.device("cpu")

    def __init__(self, blocks: Tensor, between: Tensor, carried: Tensor, struck: Tensor):
        self.num_envs = len(blocks)
        self.timestep = 1 / Physics().rate_hz
        self.between, self.carried, self.struck = between, carried, struck
        self.qpos, self.target = torch.zeros(self.num_envs, 9), torch.zeros(self.num_envs, 9)
        self.part = blocks + torch.tensor(BASE_IN_WORLD)
        applied = ("gpu_apply_articulation_qpos", "gpu_apply_articulation_qvel")
        calls = ("gpu_update_articulation_kinematics", *applied)
        targets = ("gpu_apply_articulation_target_position", "gpu_apply_articulation_target_velocity")
        self.px = SimpleNamespace(**{name: lambda: None for name in (*calls, *targets)})

    def hand(self) -> tuple[Tensor, Tensor]:
        """World positions (n, 3) and quaternions (n, 4) of the TCP."""
        pose = forward(self.qpos[:, :7].double())[0]
        quat_wxyz = torch.as_tensor(quat_from_matrix(pose[:, :3, :3].numpy()))
        return pose[:, :3, 3].float() + torch.tensor(BASE_IN_WORLD), quat_wxyz.float()

    def held(self) -> Tensor:
        """(n,) whether pads press a block."""
        closed = (self.qpos[:, 7:] <= self.between[:, None] + 1e-6).all(-1)
        return closed & (self.between > 0) & (self.target[:, 7] < self.between - 0.002)

    def step(self) -> None:
        """Arms go half the way to their targets, fingers at most 1 m/s."""
        before = self.hand()[0]
        self.qpos[:, :7] += (self.target[:, :7] - self.qpos[:, :7]) / 2
        way = (self.target[:, 7:] - self.qpos[:, 7:]).clamp(-self.timestep, self.timestep)
        self.qpos[:, 7:] = torch.maximum(self.qpos[:, 7:] + way, self.between[:, None])
        moved = (self.hand()[0] - before) * self.carried[:, None]
        self.part = self.part + torch.where(self.held()[:, None], moved, torch.zeros_like(moved))

    def _gpu_apply_all(self) -> None:
        pass

    def _gpu_fetch_all(self) -> None:
        pass

    def get_pairwise_contact_forces(self, _finger: str, _part: Any) -> Tensor:
        """(n, 3) N."""
        return torch.where(self.held()[:, None], torch.tensor([0.0, GRIP_N, 0.0]), torch.zeros(3))


class _Robot:
    links_map = {name: name for name in HAND_LINKS}

    def __init__(self, scene: ToyScene):
        self._scene = scene
        self._objs = [None] * scene.num_envs

    def get_qpos(self) -> Tensor:
        return self._scene.qpos.clone()

    def get_qvel(self) -> Tensor:
        return torch.zeros_like(self._scene.qpos)

    def set_qpos(self, qpos: Tensor) -> None:
        assert qpos.dtype == torch.float32
        self._scene.qpos[:] = qpos

    def set_qvel(self, qvel: Tensor) -> None:
        assert (qvel.dtype, qvel.shape) == (torch.float32, self._scene.qpos.shape)

    def set_joint_drive_targets(self, targets: Tensor, joints: list) -> None:
        assert (targets.dtype, targets.shape) == (torch.float32, (self._scene.num_envs, len(joints)))
        self._scene.target[:, slice(0, 7) if len(joints) == 7 else slice(7, 9)] = targets

    def set_joint_drive_velocity_targets(self, targets: Tensor, joints: list) -> None:
        assert (targets.dtype, targets.shape) == (torch.float32, (self._scene.num_envs, len(joints)))

    def get_net_contact_forces(self, links: list[str]) -> Tensor:
        force = torch.zeros(self._scene.num_envs, len(links), 3)
        low = self._scene.hand()[0][:, 2] < 0.06
        force[:, 1, 2] = torch.where(low, self._scene.struck, torch.zeros(()))
        return force


class _Body:
    def __init__(self, scene: ToyScene, pose: Any):
        self.scene, self._pose = scene, pose

    @property
    def pose(self) -> SimpleNamespace:
        position, quat_wxyz = self._pose()
        return SimpleNamespace(p=position, q=quat_wxyz)


def toy_attempt(scene: ToyScene, physics: Physics) -> Attempt:
    """An `Attempt` in a toy scene."""
    upright = torch.tensor([1.0, 0, 0, 0]).repeat(scene.num_envs, 1)
    part: Any = _Body(scene, lambda: (scene.part, upright))
    joint = SimpleNamespace(_objs=[None])
    agent: Any = SimpleNamespace(
        robot=_Robot(scene), arm_joints=[joint] * 7, finger_joints=[joint] * 2, tcp=_Body(scene, scene.hand)
    )
    any_scene: Any = scene
    motion = PandaMotion(any_scene, agent, physics)
    motion.place(np.tile(HOME, (scene.num_envs, 1)))
    corners = np.array(np.meshgrid(*([-side / 2, side / 2] for side in SIZE))).reshape(3, -1).T
    hulls = [[corners]] * scene.num_envs
    return Attempt(agent, part, hulls, motion, HandContacts(any_scene, agent, part), physics)
