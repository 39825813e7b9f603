"""Resting poses of a part as the engine holds them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import sapien
from sapien.physx import PhysxCpuSystem, PhysxMaterial, PhysxRigidDynamicComponent

from mskgrasp.core.errors import BadPart
from mskgrasp.core.geometry import Pose, quat_conjugate, quat_multiply, twist_and_swing_between
from mskgrasp.core.settings import TABLE_Z, Physics
from mskgrasp.parts import Part
from tasks.scene.part_actor import add_hulls

STILL_S = 0.1
"""A part that stays within `STILL_DISTANCE` and `STILL_ANGLE` for this time stands, s."""
STILL_DISTANCE = 2e-5
"""Greatest motion of a part at rest, m; a fifth of a Panda's repeatability."""
STILL_ANGLE = 5e-4
"""Greatest rotation of a part at rest, rad."""
SETTLE_TIMEOUT_S = 1.5
"""A part that still moves after this time does not stand, s: a slow topple takes 0.5 s."""
MAX_LEAN = 0.1
"""Greatest swing between a resting pose of the mesh and the pose in which the engine holds the hulls, rad. A
part that swings farther has toppled into another of its resting poses."""
TABLE_HALF_SIZE = (0.5, 0.5, 0.02)
"""Half the sizes of the table, m; as thick as the task's table."""


@dataclass(frozen=True, kw_only=True)
class StandingPoses:
    """Resting poses that the engine holds.

    Attributes:
        poses: k of them, (k, 3) and (k, 4); their heights over the table count, metres.
        probability: (k,) sums to 1.
        numbers: (k,) their indices among the part's resting poses.
        toppled: Probability of the resting poses that the engine does not hold, which are left out.
    """

    poses: Pose
    probability: np.ndarray
    numbers: tuple[int, ...]
    toppled: float


def standing_poses(part: Part, physics: Physics) -> StandingPoses:
    """Settle every resting pose of a part, in a separate scene.

    A part's resting poses are computed quasi-statically; in the engine its hulls may lean by a degree, or
    topple from a narrow face.

    Args:
        part: The part whose resting poses are tried one by one.
        physics: Rate and friction; the engine's other settings are those in force.

    Raises:
        BadPart: The engine holds none of the resting poses.
    """
    poses, probability, numbers = [], [], []
    for number, settled in enumerate(settled_poses(part, physics)):
        if settled is not None:
            poses.append(settled.as_vector())
            probability.append(part.resting_probability[number])
            numbers.append(number)
    if not poses:
        raise BadPart(
            f"part '{part.name}': none of its {len(part.resting_probability)} resting poses stands in the "
            "engine; check its scale and its hulls: python -m mskgrasp.parts show"
        )
    kept = float(np.sum(probability))
    return StandingPoses(
        poses=Pose.from_vector(np.stack(poses)),
        probability=np.array(probability) / kept,
        numbers=tuple(numbers),
        toppled=float(max(0.0, 1 - kept)),
    )


def settled_poses(part: Part, physics: Physics) -> Iterator[Pose | None]:
    """The pose in which the engine holds each resting pose of a part; None for one that topples.

    Args:
        part: Its resting poses are tried in their order, in one scene.
        physics: As in `standing_poses`.
    """
    scene, body = _scene_with(part, physics)
    for which in range(len(part.resting_probability)):
        start = part.resting[which]
        settled = _settle(scene, body, start, physics.rate_hz)
        yield settled if settled is not None and _lean(start, settled) <= MAX_LEAN else None


def _scene_with(part: Part, physics: Physics) -> tuple[sapien.Scene, PhysxRigidDynamicComponent]:
    scene = sapien.Scene([PhysxCpuSystem()])
    scene.set_timestep(1 / physics.rate_hz)
    table = scene.create_actor_builder()
    mu = 2 * physics.friction_table_part  # PhysX averages both materials, and a part's is without friction
    table.add_box_collision(
        sapien.Pose(p=[0, 0, TABLE_Z - TABLE_HALF_SIZE[2]]),
        np.array(TABLE_HALF_SIZE),
        material=PhysxMaterial(mu, mu, 0.0),
    )
    table.build_static(name="table")
    builder = scene.create_actor_builder()
    add_hulls(builder, part)
    body = builder.build(name=part.name).find_component_by_type(PhysxRigidDynamicComponent)
    assert isinstance(body, PhysxRigidDynamicComponent)
    return scene, body


def _settle(scene: sapien.Scene, body: PhysxRigidDynamicComponent, start: Pose, rate_hz: int) -> Pose | None:
    """The pose in which a part comes to rest; None where it does not."""
    body.entity.set_pose(sapien.Pose(start.position, start.quat_wxyz))
    body.set_linear_velocity(np.zeros(3))
    body.set_angular_velocity(np.zeros(3))
    before = start
    n_steps = max(1, round(STILL_S * rate_hz))
    for _ in range(round(SETTLE_TIMEOUT_S / STILL_S)):
        for _ in range(n_steps):
            scene.step()
        now = Pose(
            position=np.asarray(body.entity.pose.p, dtype=np.float64),
            quat_wxyz=np.asarray(body.entity.pose.q, dtype=np.float64),
        )
        if _still(before, now):
            return now
        before = now
    return None


def _still(before: Pose, after: Pose) -> bool:
    moved = float(np.linalg.norm(after.position - before.position))
    turned = quat_multiply(after.quat_wxyz, quat_conjugate(before.quat_wxyz))
    return moved < STILL_DISTANCE and 2 * float(np.linalg.norm(turned[1:])) < STILL_ANGLE


def _lean(start: Pose, settled: Pose) -> float:
    """Swing between two poses, rad: their turn about the vertical does not count."""
    return float(twist_and_swing_between(start, settled)[1])
