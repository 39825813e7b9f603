"""Contacts of the hand: forces and penetration, batched over sub-scenes."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import torch
from mani_skill.envs.scene import ManiSkillScene
from mani_skill.utils.structs.actor import Actor
from sapien.physx import PhysxBaseComponent, PhysxRigidDynamicComponent

from mskgrasp.core.geometry import Array
from tasks.robot.panda import FINGER_LINKS, HAND_LINKS, GraspPanda
from tasks.scene.arrays import arrays_for


class HandContacts:
    """Contacts of the last simulation step.

    On the CPU forces and penetration follow from PhysX's contact report. On the GPU PhysX reports forces
    alone, so that penetration is unknown (NaN).
    """

    def __init__(self, scene: ManiSkillScene, agent: GraspPanda, part: Actor):
        self._scene = scene
        self._agent = agent
        self._part = part
        self._gpu = scene.gpu_sim_enabled
        self._arrays = arrays_for(scene)
        if not self._gpu:
            links = agent.robot.links_map
            self._hand = {links[name]._objs[0]: i for i, name in enumerate(HAND_LINKS)}
            self._fingers = {links[name]._objs[0]: i for i, name in enumerate(FINGER_LINKS)}
            self._body = part._objs[0].find_component_by_type(PhysxRigidDynamicComponent)

    def hand_force(self) -> Array:
        """(n,) largest net contact force on the hand or a finger, N."""
        if self._gpu:
            return self._agent.robot.get_net_contact_forces(HAND_LINKS).norm(dim=-1).amax(dim=-1)
        largest = max((float(np.linalg.norm(v)) for v in self._impulses(self._hand).values()), default=0.0)
        return self._arrays.full(1, largest / self._scene.px.timestep)

    def outer_force(self) -> Array:
        """(n,) net contact force of all else on the hand and, while it touches it, the part together, N.

        The forces of the grip cancel in this sum. They would not on the hand alone: on the CPU PhysX reports
        no friction.
        """
        if self._gpu:
            hand = self._agent.robot.get_net_contact_forces(HAND_LINKS).sum(dim=-2)
            part = self._part.get_net_contact_forces()
            touched = self.pads_on_part()[0].amax(dim=-1, keepdim=True) > 0
            return torch.where(touched, hand + part, hand).norm(dim=-1)
        bodies = dict(self._hand)
        if self._touches_part():
            bodies[self._body] = len(bodies)
        impulses = self._impulses(bodies)
        total = sum(impulses.values(), np.zeros(3))
        return self._arrays.full(1, float(np.linalg.norm(total)) / self._scene.px.timestep)

    def _touches_part(self) -> bool:
        for contact in self._scene.px.get_contacts():
            first, second = contact.bodies
            other = second if first is self._body else first if second is self._body else None
            if other in self._hand and any(np.any(point.impulse) for point in contact.points):
                return True
        return False

    def _impulses(self, bodies: dict[PhysxBaseComponent, int]) -> dict[int, np.ndarray]:
        """Sum of the impulses on each of these bodies that is touched, N s, by its number."""
        total: dict[int, np.ndarray] = {}
        for contact in self._scene.px.get_contacts():
            for sign, body in zip((1.0, -1.0), contact.bodies, strict=True):
                i = bodies.get(body)
                if i is not None:
                    # Contact by contact: so the forces of equal grips cancel to the bit.
                    total[i] = total.get(i, 0.0) + sign * _sum([point.impulse for point in contact.points])
        return total

    def pads_on_part(self) -> tuple[Array, Array]:
        """Grip on the part.

        Returns:
            force: (n, 2) force between the part and each finger, N.
            penetration: (n,) how deep a finger and the part overlap, metres; NaN on the GPU.
        """
        if self._gpu:
            forces = [
                self._scene.get_pairwise_contact_forces(self._agent.robot.links_map[name], self._part).norm(
                    dim=-1
                )
                for name in FINGER_LINKS
            ]
            return torch.stack(forces, dim=-1), torch.full_like(forces[0], math.nan)
        impulses: tuple[list, list] = ([], [])
        deepest = 0.0
        for i, points in self._finger_points():
            impulses[i].extend(point.impulse for point in points)
            deepest = max([deepest, *(-point.separation for point in points)])
        forces = np.array([[np.linalg.norm(_sum(one)) for one in impulses]]) / self._scene.px.timestep
        return self._arrays.of(forces.astype(np.float32)), self._arrays.full(1, deepest)

    def penetration(self) -> Array:
        """(n,) how deep a finger and the part overlap, metres; NaN on the GPU."""
        if self._gpu:
            return self._arrays.full(self._scene.num_envs, math.nan)
        separations = [point.separation for _, points in self._finger_points() for point in points]
        return self._arrays.full(1, max(0.0, -min(separations, default=0.0)))

    def _finger_points(self) -> Iterator[tuple[int, list]]:
        """Number of the finger and points of each contact between a finger and the part."""
        for contact in self._scene.px.get_contacts():
            first, second = contact.bodies
            other = second if first is self._body else first if second is self._body else None
            i = self._fingers.get(other)
            if i is not None:
                yield i, contact.points


def _sum(impulses: list[np.ndarray]) -> np.ndarray:
    return np.add.reduce(impulses) if impulses else np.zeros(3)
