"""Experiments whose outcome follows from closed-form physics."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mskgrasp.core.geometry import Pose, quat_conjugate, quat_multiply
from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.core.panda_kinematics import top_down
from mskgrasp.core.settings import Physics
from mskgrasp.parts import Part
from mskgrasp.parts.solids import shape as h
from mskgrasp.validate.body_scene import BodyScene, make_body
from tasks.attempt.outcome import MAX_PENETRATION

GRAVITY = 9.81
PAD = (0.0175, 0.0185)
"""Length and height of a finger pad of the Panda, m."""
FACETS = 16
"""Sides of a prism that stands for a cylinder: two rings of as many corners are the 32 of a hull."""
RADIUS, ROLLED = 0.015, 0.0177
"""Of the cylinder, and its distance from the centre, m."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """One number that the simulation must reproduce.

    Attributes:
        name: What is checked.
        formula: Where the expected value comes from.
        unit: Of the three numbers.
        expected: By the formula.
        measured: In the simulation.
        low: Least value that passes.
        high: Greatest value that passes.
    """

    name: str
    formula: str
    unit: str
    expected: float
    measured: float
    low: float
    high: float

    @property
    def passed(self) -> bool:
        """Whether the measured value lies within the tolerance."""
        return bool(self.low <= self.measured <= self.high)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self) | {"passed": self.passed}


def run_checks(physics: Physics, report: Callable[[Check], None]) -> list[Check]:
    """Runs all checks under some settings, and calls ``report`` with each when it is done."""
    with tempfile.TemporaryDirectory(prefix="mskgrasp-validate-") as scratch:
        bodies = _bodies(Path(scratch), physics)
        scene = BodyScene(physics, bodies["block"])
        done = []
        try:
            for experiment in EXPERIMENTS:
                for check in experiment(scene, bodies):
                    report(check)
                    done.append(check)
        finally:
            scene.close()
    return done


def _bodies(folder: Path, physics: Physics) -> dict[str, Part]:
    def box(name: str, size: tuple[float, float, float], mass: float) -> Part:
        x, y, z = (500 * edge for edge in size)
        return make_body(folder, name, h.block(-x, x, -y, y, -z, z).solid(), mass)

    heavy = 2 * physics.friction_pad_part * physics.finger_force / GRAVITY
    light, strong = _lever_masses(physics)
    angles = 2 * math.pi * (np.arange(2 * FACETS) + 0.5) / (2 * FACETS)
    rim = 1e3 * RADIUS / math.cos(math.pi / FACETS / 2) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    # Two prisms turned against each other have the corners of one with twice the sides.
    hulls = [piece for start in (0, 1) for piece in h.plate(rim[start::2], -20, 20).hulls]
    cylinder = h.tool(h.plate(rim, -20, 20).body, hulls).turned("y", 90)
    return {
        "block": box("block", BLOCK, 0.1),
        "heavy": box("heavy", BLOCK, heavy),
        "cylinder": make_body(folder, "cylinder", cylinder.solid(), 0.1),
        "light-lever": box("light-lever", LEVER, light),
        "heavy-lever": box("heavy-lever", LEVER, strong),
    }


BLOCK = (0.04, 0.02, 0.03)
LEVER = (0.15, 0.01, 0.01)
LEVER_ARM = 0.06
BLOCKS = 40


def holding_limit(scene: BodyScene, bodies: dict[str, Part]) -> Iterator[Check]:
    """A block held aloft: the weaker the grip, the sooner it slips."""
    block, mu = bodies["heavy"], scene.physics.friction_pad_part

    def height(load: float, seconds: float) -> tuple[float, float]:
        """Time since the grip was weakened, s, and way that the block has slipped by then, m."""
        scene.pinch(block)
        before = scene.pose_in_hand().position[2]
        scene.env.agent.set_finger_force(block.mass * GRAVITY / (2 * mu * load))
        with scene.env.motion.coarsely():  # as a part is lifted
            t = scene.step(seconds)
        return t, float(scene.pose_in_hand().position[2] - before)

    # One percent over the limit, a block slips by 4 mm in this time.
    loads = np.round(np.arange(0.90, 1.11, 0.01), 3)
    yield Check(
        name="load at which a pinched block slips",
        formula="m g = 2 mu F",
        unit="of 2 mu F",
        expected=1.0,
        measured=float(next((load for load in loads if height(load, 0.3)[1] > 1e-3), math.inf)),
        low=0.95,
        high=1.05,
    )
    t, way = np.array([height(1.25, seconds) for seconds in (0.04, 0.08, 0.12)]).T
    first, second = np.diff(way) / np.diff(t)
    yield _near(
        "acceleration of a block that slips, load 1.25", "g (1 - 1/1.25)", "m/s^2",
        GRAVITY * (1 - 1 / 1.25), (second - first) / (0.5 * (t[2] - t[0])), 0.1,
    )  # fmt: skip


def free_fall(scene: BodyScene, bodies: dict[str, Part]) -> Iterator[Check]:
    """A block dropped in the air, and one that spins there."""
    x, y = scene.env.region_centre
    clear_of_the_arm = (x, y + 0.3, 0.5)
    scene.place(bodies["block"], clear_of_the_arm)
    before = scene.pose().position[2]
    t = scene.step(0.2)
    fallen = before - scene.pose().position[2]
    yield _near("fall in 0.2 s", "g t^2 / 2", "m", GRAVITY * t**2 / 2, float(fallen), 0.025)
    scene.place(bodies["block"], clear_of_the_arm)
    scene.body.disable_gravity = True
    spin = 10.0
    scene.body.set_angular_velocity([0.0, 0.0, spin])
    before = scene.pose()
    t = scene.step(0.2)
    yield _near(
        "turn of a free block in 0.2 s", "omega t", "rad", spin * t, _turn(before, scene.pose(), 2), 0.01
    )


def sliding(scene: BodyScene, bodies: dict[str, Part]) -> Iterator[Check]:
    """A block on the table: sliding to rest, pushed too little, pushed enough."""
    mu, mass = scene.physics.friction_table_part, bodies["block"].mass
    x, y = scene.env.region_centre
    rest = (x, y, BLOCK[2] / 2)
    scene.place(bodies["block"], rest)
    scene.step(0.05)
    before, speed = scene.pose().position, 0.5
    scene.body.set_linear_velocity([0.0, speed, 0.0])
    scene.step(0.5)
    way = float(np.linalg.norm((scene.pose().position - before)[:2]))
    yield _near(
        "way of a block that slides to rest", "v^2 / (2 mu g)", "m", speed**2 / (2 * mu * GRAVITY), way, 0.05
    )
    scene.place(bodies["block"], rest)
    scene.step(0.05)
    before = scene.pose().position
    scene.push([0.0, 0.9 * mu * mass * GRAVITY, 0.0], 0.3)
    way = float(np.linalg.norm((scene.pose().position - before)[:2]))
    yield Check(
        name="way of a block pushed with 0.9 mu m g in 0.3 s", formula="none: friction holds", unit="m",
        expected=0.0, measured=way, low=0.0, high=2e-4,
    )  # fmt: skip
    scene.place(bodies["block"], rest)
    scene.step(0.05)
    before = scene.pose().position
    t = scene.push([0.0, 1.5 * mu * mass * GRAVITY, 0.0], 0.3)
    way = float(np.linalg.norm((scene.pose().position - before)[:2]))
    yield _near(
        "acceleration of a block pushed with 1.5 mu m g",
        "0.5 mu g",
        "m/s^2",
        0.5 * mu * GRAVITY,
        2 * way / t**2,
        0.05,
    )


def rolling(scene: BodyScene, bodies: dict[str, Part]) -> Iterator[Check]:
    """A cylinder lying along the pads, off centre: the first pad rolls it towards the other.

    Quasi-static: of a cylinder that is pushed at the height of its axis, the table's friction turns it with
    more moment than the pad's friction can oppose (mu < 1), so it rolls. At the production speed it would
    slide first, until friction has brought it to its speed.
    """
    slow = BodyScene(scene.physics.model_copy(update={"finger_speed": 0.02}), bodies["cylinder"])
    try:
        x, y = slow.env.region_centre
        slow.place(bodies["cylinder"], (x, y - ROLLED, RADIUS))
        before = slow.pose()
        grasp = torch.tensor([[x, y, RADIUS, 0.0]], dtype=torch.float64)
        slow.env.motion.place(top_down(grasp)[0])
        slow.env.motion.move_fingers(-MAX_OPENING / 2)
        after = slow.pose()
    finally:
        slow.close()
    way = float(after.position[1] - before.position[1])
    yield _near(
        "turn of a cylinder rolled by a pad", "way / radius", "deg", math.degrees(way / RADIUS),
        -math.degrees(_turn(before, after, 0)), 0.05,
    )  # fmt: skip


def lever(scene: BodyScene, bodies: dict[str, Part]) -> Iterator[Check]:
    """A bar held off its middle: friction of the pads holds one, another swings down."""
    for name, low, high in (("light-lever", 0.0, 2.0), ("heavy-lever", 20.0, 180.0)):
        part = bodies[name]
        scene.pinch(part, (LEVER_ARM, 0.0, 0.0))
        before = scene.pose_in_hand()
        with scene.env.motion.coarsely():
            scene.step(0.3)
        turn = abs(math.degrees(_turn(before, scene.pose_in_hand(), 1)))
        uniform, most = _pad_moments(scene.physics)
        moment = part.mass * GRAVITY * LEVER_ARM
        yield Check(
            name=f"turn in 0.3 s of a lever, {moment / uniform:.1f} of the friction moment",
            formula="holds" if name == "light-lever" else f"turns: {moment / most:.1f} of the most",
            unit="deg",
            expected=0.0 if name == "light-lever" else 90.0,
            measured=turn,
            low=low,
            high=high,
        )


def _pad_moments(physics: Physics) -> tuple[float, float]:
    """Friction moment of both pads on the lever, N m: under even pressure, and under the most uneven."""
    a, b = PAD[0], LEVER[2]
    u, v = np.meshgrid(np.linspace(-a / 2, a / 2, 201), np.linspace(-b / 2, b / 2, 201))
    radius = np.hypot(u, v)
    force = 2 * physics.friction_pad_part * physics.finger_force
    return force * float(radius.mean()), force * float(radius.max())


def _lever_masses(physics: Physics) -> tuple[float, float]:
    uniform, most = _pad_moments(physics)
    return 0.4 * uniform / (GRAVITY * LEVER_ARM), 1.5 * most / (GRAVITY * LEVER_ARM)


def centring(scene: BodyScene, bodies: dict[str, Part]) -> Iterator[Check]:
    """A block off centre, and one that lies turned, end as the pads want them."""
    x, y = scene.env.region_centre
    z = BLOCK[2] / 2
    outcome = scene.grasp(bodies["block"], (x, y + 0.012, z))
    yield Check(
        name="shift of a block 12 mm off centre", formula="to the middle", unit="mm",
        expected=-12.0, measured=1e3 * float(outcome["displacement"][1]), low=-12.15, high=-11.85,
    )  # fmt: skip
    outcome = scene.grasp(bodies["block"], (x, y, z), 0.3)
    yield Check(
        name="turn of a block that lies turned by 0.3 rad", formula="flat against the pads", unit="deg",
        expected=-math.degrees(0.3), measured=math.degrees(float(outcome["displacement"][3])),
        low=-math.degrees(0.3) - 0.3, high=-math.degrees(0.3) + 0.3,
    )  # fmt: skip
    rng = np.random.default_rng(0)
    errors = []
    for _ in range(BLOCKS):
        turn = float(rng.uniform(-0.5, 0.5))
        dx, dy = rng.uniform(-0.007, 0.007, 2)
        # One after the other in the same scene, as the collector does it.
        outcome = scene.grasp(bodies["block"], (x + dx, y + dy, z), turn, fresh=False)
        errors.append(abs(math.degrees(float(outcome["displacement"][3]) + turn)))
    yield Check(
        name=f"greatest angle of {BLOCKS} random blocks", formula="flat against the pads", unit="deg",
        expected=0.0, measured=float(np.max(errors)), low=0.0, high=0.3,
    )  # fmt: skip
    outcome = scene.grasp(bodies["block"], (x, y, z))
    yield Check(
        name="overlap of pads and a block", formula="none", unit="mm", expected=0.0,
        measured=1e3 * float(outcome["penetration"]), low=0.0, high=100 * MAX_PENETRATION,
    )  # fmt: skip


EXPERIMENTS = (holding_limit, free_fall, sliding, rolling, lever, centring)


def _near(name: str, formula: str, unit: str, expected: float, measured: float, share: float) -> Check:
    margin = share * abs(expected)
    return Check(
        name=name, formula=formula, unit=unit, expected=expected, measured=measured,
        low=expected - margin, high=expected + margin,
    )  # fmt: skip


def _turn(before: Pose, after: Pose, axis: int) -> float:
    """Signed angle of the turn from before to after about a coordinate axis, radians."""
    q = quat_multiply(after.quat_wxyz, quat_conjugate(before.quat_wxyz))
    return float(2 * math.atan2(q[1 + axis], q[0]))
