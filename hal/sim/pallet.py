"""Parts that stay on the pallet while the next one is grasped."""

from __future__ import annotations

from dataclasses import dataclass, replace

import sapien
from mani_skill.envs.scene import ManiSkillScene
from mani_skill.utils.structs.actor import Actor

from mskgrasp.core.settings import TABLE_Z, Region
from mskgrasp.parts import Part
from tasks.scene.frames import base_pose
from tasks.scene.part_actor import add_part

FALLEN = 0.05
"""A part this far below the table has fallen off it, m."""


@dataclass(frozen=True)
class Lying:
    """A part in the scene, and its body."""

    part: Part
    body: Actor


def outside(region: Region, bodies: list[Lying]) -> list[tuple[Lying, sapien.Pose]]:
    """Bodies whose origin lies on the table but not in a region, with their poses in ManiSkill's world."""
    x_min, x_max, y_min, y_max = region
    found = []
    for lying in bodies:
        x, y, z = base_pose(lying.body).position[0].tolist()
        if z > TABLE_Z - FALLEN and not (x_min <= x <= x_max and y_min <= y <= y_max):
            found.append((lying, lying.body.pose.sp))
    return found


def restore(scene: ManiSkillScene, lying: Lying, pose: sapien.Pose, number: int, friction: float) -> Lying:
    """Add a part to a new scene at its pose in the last one, as a dynamic body.

    Args:
        scene: The new scene.
        lying: The part, and its body in the last scene.
        pose: Pose of the part in ManiSkill's world.
        number: Distinguishes it from other bodies of the same name.
        friction: Coefficient of its material; the effective one is the mean with that of the other body: none
            on the table and on the part presented, twice the effective one on the pads.
    """
    body = add_part(scene, replace(lying.part, name=f"{lying.part.name}-beside-{number}"), 0, friction)
    body.set_pose(pose)
    return Lying(lying.part, body)
