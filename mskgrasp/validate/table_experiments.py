"""Bodies in the air and on the table: fall, spin, slide, roll, topple."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import torch

from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.core.panda_kinematics import top_down
from mskgrasp.parts import Part
from mskgrasp.parts.solids import shape as h
from mskgrasp.validate.body_scene import BLOCK, GRAVITY, BodyScene, Workshop, turn_about
from mskgrasp.validate.check import Check, near, within

FACETS = 16
"""Sides of a prism that represents a cylinder: two rings of as many corners are the 32 of a hull."""
RADIUS, ROLLED = 0.015, 0.0177
"""Radius of the cylinder, and its distance from the centre, m."""
TOWER = (0.02, 0.02, 0.04)
"""Edges of the prism that topples, m."""


def free_fall(scene: BodyScene, workshop: Workshop) -> Iterator[Check]:
    """A block dropped in the air, and one that spins there."""
    x, y = scene.env.region_centre
    clear_of_the_arm = (x, y + 0.3, 0.5)
    scene.place(workshop.block(), clear_of_the_arm)
    before = scene.pose().position[2]
    t = scene.step(0.2)
    fallen = before - scene.pose().position[2]
    yield near("fall in 0.2 s", "g t^2 / 2", "m", GRAVITY * t**2 / 2, float(fallen), 0.025)
    scene.place(workshop.block(), clear_of_the_arm)
    scene.body.disable_gravity = True
    spin = 10.0
    scene.body.set_angular_velocity([0.0, 0.0, spin])
    before = scene.pose()
    t = scene.step(0.2)
    turned = turn_about(before, scene.pose(), 2)
    yield near("turn of a free block in 0.2 s", "omega t", "rad", spin * t, turned, 0.01)


def sliding(scene: BodyScene, workshop: Workshop) -> Iterator[Check]:
    """A block on the table: sliding to rest, pushed too little, pushed enough."""
    mu, mass = scene.physics.friction_table_part, workshop.block().mass
    x, y = scene.env.region_centre
    rest = (x, y, BLOCK[2] / 2)
    scene.place(workshop.block(), rest)
    scene.step(0.05)
    before, speed = scene.pose().position, 0.5
    scene.body.set_linear_velocity([0.0, speed, 0.0])
    scene.step(0.5)
    way = float(np.linalg.norm((scene.pose().position - before)[:2]))
    expected = speed**2 / (2 * mu * GRAVITY)
    yield near("way of a block that slides to rest", "v^2 / (2 mu g)", "m", expected, way, 0.05)
    scene.place(workshop.block(), rest)
    scene.step(0.05)
    before, spin = scene.pose(), 20.0
    scene.body.set_angular_velocity([0.0, 0.0, spin])
    scene.step(0.3)
    turned = turn_about(before, scene.pose(), 2)
    # On its four corners, at r from the middle: friction mu m g at r brakes a moment of inertia m r^2 / 3.
    corner = math.hypot(BLOCK[0], BLOCK[1]) / 2
    expected = math.degrees(spin**2 * corner / (6 * mu * GRAVITY))
    yield near(
        "turn of a block that spins to rest", "w^2 r / (6 mu g)", "deg", expected, math.degrees(turned), 0.05
    )
    scene.place(workshop.block(), rest)
    scene.step(0.05)
    before = scene.pose().position
    scene.push([0.0, 0.9 * mu * mass * GRAVITY, 0.0], 0.3)
    way = float(np.linalg.norm((scene.pose().position - before)[:2]))
    yield Check(
        name="way of a block pushed with 0.9 mu m g in 0.3 s", formula="none: friction holds", unit="m",
        expected=0.0, measured=way, low=0.0, high=2e-4,
    )  # fmt: skip
    scene.place(workshop.block(), rest)
    scene.step(0.05)
    before = scene.pose().position
    t = scene.push([0.0, 1.5 * mu * mass * GRAVITY, 0.0], 0.3)
    way = float(np.linalg.norm((scene.pose().position - before)[:2]))
    name, expected = "acceleration of a block pushed with 1.5 mu m g", 0.5 * mu * GRAVITY
    yield near(name, "0.5 mu g", "m/s^2", expected, 2 * way / t**2, 0.05)


def rolling(scene: BodyScene, workshop: Workshop) -> Iterator[Check]:
    """A cylinder rolled by a pad, and one pushed along the table."""
    yield from _rolled_by_a_pad(scene, workshop)
    yield from _pushed(scene, workshop)


def _rolled_by_a_pad(scene: BodyScene, workshop: Workshop) -> Iterator[Check]:
    """A cylinder lying along the pads, off centre: the first pad rolls it towards the other.

    Quasi-static: of a cylinder that is pushed at the height of its axis, the table's friction turns it with
    more moment than the pad's friction can oppose (mu < 1), so it rolls. At the production speed it would
    slide first, until friction has brought it to its speed.
    """
    cylinder = _cylinder(workshop)
    slow = BodyScene(scene.physics.model_copy(update={"finger_speed": 0.02}), cylinder)
    try:
        x, y = slow.env.region_centre
        slow.place(cylinder, (x, y - ROLLED, RADIUS))
        before = slow.pose()
        grasp = torch.tensor([[x, y, RADIUS, 0.0]], dtype=torch.float64)
        slow.env.motion.place(top_down(grasp)[0])
        slow.env.motion.move_fingers(-MAX_OPENING / 2)
        after = slow.pose()
    finally:
        slow.close()
    expected = math.degrees(float(after.position[1] - before.position[1]) / RADIUS)
    turned = -math.degrees(turn_about(before, after, 0))
    yield near("turn of a cylinder rolled by a pad", "way / radius", "deg", expected, turned, 0.05)


def _pushed(scene: BodyScene, workshop: Workshop) -> Iterator[Check]:
    """A cylinder pushed at its axis with a third of the force at which it would slip (3 mu m g)."""
    cylinder = _cylinder(workshop)
    x, y = scene.env.region_centre
    scene.place(cylinder, (x, y - 0.05, RADIUS))
    scene.step(0.05)
    before = scene.pose()
    force = scene.physics.friction_table_part * cylinder.mass * GRAVITY
    first, speed, turned = before, 0.0, 0.0
    seconds = 0.02
    for _ in range(9):  # in stretches of less than half a turn, so that turns can be added up
        t = scene.push([0.0, force, 0.0], seconds)
        now = scene.pose()
        turned -= turn_about(first, now, 0)
        speed = float(now.position[1] - first.position[1]) / t
        first = now
    way = float(first.position[1] - before.position[1])
    yield near(
        "turn of a cylinder pushed along the table", "way / radius: it rolls, without slipping", "deg",
        math.degrees(way / RADIUS), math.degrees(turned), 0.02,
    )  # fmt: skip
    # The speed in the middle of the last stretch.
    rolled = way - speed * seconds / 2
    expected = math.sqrt(2 * _kept_work(force * rolled, rolled) / (1.5 * cylinder.mass))
    yield near(
        "its speed",
        "3/4 m v^2 = F s, less the impacts of its facets (McGeer 1990)",
        "m/s",
        expected,
        speed,
        0.05,
    )


def _kept_work(work: float, way: float) -> float:
    """Kinetic energy of a solid prism of 2 `FACETS` facets that rolls over them, J.

    At every impact it turns about the next corner with the angular momentum about it that it had before:
    (1/2 + cos a) / (1/2 + 1) of its speed, a the angle between corners (McGeer, Passive dynamic walking,
    Int. J. Robotics Research 9(2), 1990, section 3, with the moment of inertia m r^2 / 2).
    """
    angle = math.pi / FACETS
    kept = ((0.5 + math.cos(angle)) / 1.5) ** 2
    steps = way / (RADIUS * angle)
    return work / steps * (1 - kept**steps) / (1 - kept)


def _cylinder(workshop: Workshop) -> Part:
    angles = 2 * math.pi * (np.arange(2 * FACETS) + 0.5) / (2 * FACETS)
    rim = 1e3 * RADIUS / math.cos(math.pi / FACETS / 2) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    # Two prisms turned against each other have the corners of one with twice the sides.
    hulls = [piece for start in (0, 1) for piece in h.plate(rim[start::2], -20, 20).hulls]
    return workshop.part("cylinder", h.tool(h.plate(rim, -20, 20).body, hulls).turned("y", 90), 0.1)


def toppling(scene: BodyScene, workshop: Workshop) -> Iterator[Check]:
    """A prism that leans on its lower edge: it falls back, until its centre is beyond the edge."""
    prism = workshop.box("tower", TOWER, 0.1)
    critical = math.degrees(math.atan2(TOWER[1], TOWER[2]))
    leans = np.arange(critical - 2, critical + 2.01, 0.5)
    over = next((lean for lean in leans if _topples(scene, prism, math.radians(lean))), math.inf)
    yield within(
        "lean at which a prism topples", "atan(width / height): its centre is over the edge", "deg",
        critical, float(over), 1.0,
    )  # fmt: skip


def _topples(scene: BodyScene, prism: Part, lean: float) -> bool:
    x, y = scene.env.region_centre
    half_y, half_z = TOWER[1] / 2, TOWER[2] / 2
    # Leaning towards +y on the edge at (y, 0): its centre, seen from the edge, is turned about x by -lean.
    across = -half_y * math.cos(lean) + half_z * math.sin(lean)
    up = half_y * math.sin(lean) + half_z * math.cos(lean)
    quat = np.array([math.cos(-lean / 2), math.sin(-lean / 2), 0.0, 0.0])
    scene.place(prism, (x, y + across, up), quat)
    start = scene.pose()
    scene.step(0.7)
    return -turn_about(start, scene.pose(), 0) > 0
