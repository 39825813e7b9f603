"""Contacts of the hand: forces and penetration, batched over sub-scenes."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator

import numpy as np
import torch
from mani_skill.envs.scene import ManiSkillScene
from mani_skill.utils.structs.actor import Actor
from sapien import Component
from sapien.physx import PhysxContact, PhysxRigidDynamicComponent

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
            self._hand = {links[name]._objs[0] for name in HAND_LINKS}
            self._fingers = {links[name]._objs[0]: i for i, name in enumerate(FINGER_LINKS)}
            self._body = part._objs[0].find_component_by_type(PhysxRigidDynamicComponent)

    def load(self, *, holding: bool = False) -> Array:
        """(n, 3) net contact force on the hand with its fingers, base axes, N.

        On the CPU PhysX reports normal forces alone.

        Args:
            holding: A part that the hand touches counts as one with it, so that the grip cancels.
        """
        if self._gpu:
            hand = self._agent.robot.get_net_contact_forces(HAND_LINKS).sum(dim=-2)
            if not holding:
                return hand
            touched = self.pads_on_part()[0].amax(dim=-1, keepdim=True) > 0
            return torch.where(touched, hand + self._part.get_net_contact_forces(), hand)
        contacts = self._scene.px.get_contacts()
        members = self._members(contacts, holding)
        total = np.zeros(3)
        for contact in contacts:
            first, second = (body in members for body in contact.bodies)
            if first is not second:
                total += (1.0 if first else -1.0) * _sum([point.impulse for point in contact.points])
        return self._arrays.of((total / self._scene.px.timestep)[None])

    def near(self, *, holding: bool = False) -> bool:
        """Whether anything is within the contact offset of a hand, so that a load may follow."""
        if self._gpu:
            return True
        contacts = self._scene.px.get_contacts()
        members = self._members(contacts, holding)
        return any((one.bodies[0] in members) is not (one.bodies[1] in members) for one in contacts)

    def _members(self, contacts: list[PhysxContact], holding: bool) -> Collection[Component]:
        """The bodies of the hand, and the part where it counts as one with it."""
        if holding and any(
            self._body in contact.bodies
            and any(body in self._hand for body in contact.bodies)
            and any(np.any(point.impulse) for point in contact.points)
            for contact in contacts
        ):
            return {*self._hand, self._body}
        return self._hand

    def pads_on_part(self) -> tuple[Array, Array]:
        """Grip on the part.

        Returns:
            force: (n, 2) force between the part and each finger, N.
            penetration: (n,) depth of overlap of a finger and the part, metres; NaN on the GPU.
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
        """(n,) depth of overlap of a finger and the part, metres; NaN on the GPU."""
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
