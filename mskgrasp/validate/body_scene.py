"""Plain bodies in the very scene that makes the labels: same hand, same table, same settings."""

from __future__ import annotations

import logging
from pathlib import Path

import gymnasium
import numpy as np
import sapien
import torch
from sapien.physx import PhysxRigidDynamicComponent

from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.core.panda_kinematics import top_down
from mskgrasp.core.settings import Physics
from mskgrasp.parts import Part, store
from mskgrasp.parts.solids.solid import Solid
from mskgrasp.parts.write_solid import write_solid
from tasks import GraspDisplacementEnv
from tasks.scene.frames import base_pose

ALOFT = 0.25
"""Height at which the hand holds bodies that must not meet the table, m."""


def make_body(folder: Path, name: str, solid: Solid, mass: float) -> Part:
    """A part folder under ``folder`` for a plain body (millimetres) of some mass, kg."""
    volume = float(solid.mesh.volume) * 1e-9
    with store.kept_in(folder):
        return write_solid(
            solid,
            name=name,
            family="plain",
            source="closed-form check",
            licence="Apache-2.0",
            density=mass / volume,
            dimensions={},
            recipe_hash="closed-form check",
        )


class BodyScene:
    """One sub-scene on the CPU whose part is changed from check to check.

    Args:
        physics: The settings under test.
        part: The first part.
    """

    def __init__(self, physics: Physics, part: Part):
        logging.getLogger("mani_skill").setLevel(logging.ERROR)
        self._env = gymnasium.make(
            "GraspDisplacement-v1",
            parts=[str(part.folder)],
            obs_mode="none",
            render_backend="none",
            physics=physics.model_dump(),
        )
        env = self._env.unwrapped
        assert isinstance(env, GraspDisplacementEnv)
        self.env = env
        self.physics = physics

    def close(self) -> None:
        """Frees the simulation."""
        self._env.close()

    def place(
        self,
        part: Part,
        position: tuple[float, float, float],
        quat_wxyz: np.ndarray | None = None,
        *,
        fresh: bool = True,
    ) -> None:
        """Places the part at rest at a pose in the base frame, metres, with the arm at home."""
        quat = np.array([1.0, 0, 0, 0]) if quat_wxyz is None else quat_wxyz
        pose = np.array([[*position, *quat]])
        scene = dict(parts=[str(part.folder)], reconfigure=True) if fresh else {}
        self.env.reset(seed=0, options=dict(scene, pose_base_obj=pose))

    @property
    def body(self) -> PhysxRigidDynamicComponent:
        """The part's rigid body."""
        entity: sapien.Entity = self.env.part._objs[0]
        found = entity.find_component_by_type(PhysxRigidDynamicComponent)
        assert isinstance(found, PhysxRigidDynamicComponent)
        return found

    def pose(self) -> Pose:
        """``T_base_obj`` of the part, position (3,) and quaternion (4,)."""
        pose = base_pose(self.env.part)
        return Pose(position=pose.position[0].double().numpy(), quat_wxyz=pose.quat_wxyz[0].double().numpy())

    def pose_in_hand(self) -> Pose:
        """``T_tcp_obj`` with the measured TCP."""
        pose = self.env.tcp_pose().inverse() @ base_pose(self.env.part)
        return Pose(position=pose.position[0].double().numpy(), quat_wxyz=pose.quat_wxyz[0].double().numpy())

    def step(self, seconds: float) -> float:
        """Advances the simulation; returns the time that it advanced, s."""
        n = self.env.motion.n_steps(seconds)
        self.env.motion.step(n)
        return n / self.env.motion.rate_hz

    def push(self, force: list[float], seconds: float) -> float:
        """Advances the simulation with a constant force (x, y, z), N, on the part's centre of mass."""
        n = self.env.motion.n_steps(seconds)
        for _ in range(n):
            body = self.body
            body.add_force_at_point(force, body.entity.pose.p)
            self.env.motion.step(1)
        return n / self.env.motion.rate_hz

    def pinch(self, part: Part, along: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        """Closes the hand aloft on a weightless part, then gives the part its weight.

        Args:
            part: What is held; its axes are those of the base.
            along: Where its centroid is, seen from the point between the pads, base frame, metres.
        """
        x, y = self.env.region_centre
        self.place(part, (x + along[0], y + along[1], ALOFT + along[2]))
        grasp = torch.tensor([[x, y, ALOFT, 0.0]], dtype=torch.float64)
        self.env.motion.place(top_down(grasp)[0])
        self.body.disable_gravity = True
        self.env.motion.move_fingers(-MAX_OPENING / 2)
        self.body.disable_gravity = False

    def grasp(
        self, part: Part, position: tuple[float, float, float], turn: float = 0.0, *, fresh: bool = True
    ) -> dict[str, np.ndarray]:
        """Places the part at a pose (turned about z) and grasps the middle of the region at 20 mm."""
        self.place(part, position, np.array([np.cos(turn / 2), 0, 0, np.sin(turn / 2)]), fresh=fresh)
        x, y = self.env.region_centre
        outcome = self.env.attempt.run(torch.tensor([[x, y, 0.02, 0.0]]))
        return {name: value[0].double().numpy() for name, value in outcome.items()}
