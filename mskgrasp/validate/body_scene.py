"""Plain bodies in the scene that makes the labels: same hand, same table, same settings."""

from __future__ import annotations

import logging
import math
from pathlib import Path

import gymnasium
import numpy as np
import sapien
import torch
from sapien.physx import PhysxRigidDynamicComponent

from mskgrasp.core.geometry import Pose, quat_conjugate, quat_multiply
from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.core.panda_kinematics import top_down
from mskgrasp.core.settings import Physics
from mskgrasp.parts import Part, store
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.write_solid import write_solid
from tasks import GraspDisplacementEnv
from tasks.scene.frames import base_pose

ALOFT = 0.25
"""Height at which the hand holds bodies that must not meet the table, m."""
GRAVITY = 9.81
"""Acceleration of gravity, m/s^2."""
BLOCK = (0.04, 0.02, 0.03)
"""Edges of the block of most experiments, m."""


class Workshop:
    """Maker of part folders of plain bodies.

    Args:
        folder: Folder for the parts.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        self._made: dict[str, Part] = {}

    def block(self) -> Part:
        """A block of 100 g."""
        return self.box("block", BLOCK, 0.1)

    def box(self, name: str, size: tuple[float, float, float], mass: float) -> Part:
        """A box with edges in metres and a mass in kg."""
        x, y, z = (500 * edge for edge in size)
        return self.part(name, h.block(-x, x, -y, y, -z, z), mass)

    def part(self, name: str, shape: h.Shape, mass: float) -> Part:
        """A body of some mass, kg; one that was made under that name before is returned."""
        if name not in self._made:
            solid = shape.solid()
            with store.kept_in(self._folder):
                self._made[name] = write_solid(
                    solid,
                    name=name,
                    family="plain",
                    source="closed-form check",
                    licence="Apache-2.0",
                    density=mass / (float(solid.mesh.volume) * 1e-9),
                    dimensions={},
                    recipe_hash="closed-form check",
                )
        return self._made[name]

    def centroid(self, part: Part) -> np.ndarray:
        """Centroid (3,) of a body in the axes and the unit, mm, in which its shape was given."""
        return 1e3 * np.asarray(store.read_record(part.folder)["centroid_in_source"])


def turn_about(before: Pose, after: Pose, axis: int) -> float:
    """Signed angle of the turn from before to after about a coordinate axis, radians."""
    q = quat_multiply(after.quat_wxyz, quat_conjugate(before.quat_wxyz))
    return float(2 * math.atan2(q[1 + axis], q[0]))


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
        """Free the simulation."""
        self._env.close()

    def place(
        self,
        part: Part,
        position: tuple[float, float, float],
        quat_wxyz: np.ndarray | None = None,
        *,
        fresh: bool = True,
    ) -> None:
        """Place the part at rest at a pose in the base frame, metres, with the arm at home."""
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
        """Advance the simulation; return the time that it advanced, s."""
        n = self.env.motion.n_steps(seconds)
        self.env.motion.step(n)
        return n / self.env.motion.rate_hz

    def push(self, force: list[float], seconds: float) -> float:
        """Advance the simulation with a constant force (x, y, z), N, on the part's centre of mass."""
        n = self.env.motion.n_steps(seconds)
        for _ in range(n):
            body = self.body
            body.add_force_at_point(force, body.entity.pose.p)
            self.env.motion.step(1)
        return n / self.env.motion.rate_hz

    def twist(self, torque: list[float], seconds: float) -> None:
        """Advance the simulation with a constant torque (x, y, z) on the part, N m."""
        for _ in range(self.env.motion.n_steps(seconds)):
            self.body.add_force_torque([0.0, 0.0, 0.0], torque)
            self.env.motion.step(1)

    def pinch(self, part: Part, along: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        """Close the raised hand on a weightless part, then give the part its weight.

        Args:
            part: Part to hold; its axes are those of the base.
            along: Position of its centroid relative to the point between the pads, base frame, metres.
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
        """Place the part at a pose (turned about z) and grasps the middle of the region at 20 mm."""
        self.place(part, position, np.array([np.cos(turn / 2), 0, 0, np.sin(turn / 2)]), fresh=fresh)
        x, y = self.env.region_centre
        outcome = self.env.attempt.run(torch.tensor([[x, y, 0.02, 0.0]]))
        return {name: value[0].double().numpy() for name, value in outcome.items()}
