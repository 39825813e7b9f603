"""Bodies in the hand: slip, turn, are squeezed out, are centred, mirrored."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.grasp import PAD_HEIGHT, PAD_WIDTH
from mskgrasp.core.settings import Physics
from mskgrasp.parts import Part
from mskgrasp.parts.solids import shape as h
from mskgrasp.validate.body_scene import BLOCK, GRAVITY, BodyScene, Workshop, turn_about
from mskgrasp.validate.check import Check, near, within
from tasks.attempt.outcome import MAX_PENETRATION

PAD_BELOW = 0.009
"""Reach of a pad below the TCP, m."""
BAR = (0.15, 0.01, 0.01)
"""Edges of the bar that is held across its middle, m."""
SLUGGISH = 5.0
"""Mass of weightless bodies that are turned in the hand, kg. PhysX applies a torque at the beginning of a
step and friction in its course: a body of little inertia would turn in between."""
BLOCKS = 40
MIRRORED = 12
"""Starts of which each is compared with its mirror image."""


def holding_limit(scene: BodyScene, workshop: Workshop) -> Iterator[Check]:
    """A block held above the table: the weaker the grip, the sooner it slips."""
    mu = scene.physics.friction_pad_part
    block = workshop.box("heavy", BLOCK, 2 * mu * scene.physics.finger_force / GRAVITY)

    def height(load: float, seconds: float) -> tuple[float, float]:
        """Time since the grip was weakened, s, and distance that the block has slipped by then, m."""
        scene.pinch(block)
        before = scene.pose_in_hand().position[2]
        scene.env.agent.set_finger_force(block.mass * GRAVITY / (2 * mu * load))
        with scene.env.motion.coarsely():  # as a part is lifted
            t = scene.step(seconds)
        return t, float(scene.pose_in_hand().position[2] - before)

    # One percent over the limit, a block slips by 4 mm in this time.
    loads = np.round(np.arange(0.90, 1.11, 0.01), 3)
    slips = float(next((load for load in loads if height(load, 0.3)[1] > 1e-3), math.inf))
    yield within("load at which a pinched block slips", "m g = 2 mu F", "of 2 mu F", 1.0, slips, 0.05)
    t, way = np.array([height(1.25, seconds) for seconds in (0.04, 0.08, 0.12)]).T
    first, second = np.diff(way) / np.diff(t)
    yield near(
        "acceleration of a block that slips, load 1.25", "g (1 - 1/1.25)", "m/s^2",
        GRAVITY * (1 - 1 / 1.25), (second - first) / (0.5 * (t[2] - t[0])), 0.1,
    )  # fmt: skip
    scene.env.agent.set_finger_force(scene.physics.finger_force)


def torsion(scene: BodyScene, workshop: Workshop) -> Iterator[Check]:
    """Torque about the closing axis that the pads hold: at a point, on a bar, on a face.

    PhysX gives a contact patch with one point the moment mu F r, r the patch radius, and one with more the
    friction of its two points that are farthest apart, each under half of the force: mu F d / 2. A soft pad
    under uniform pressure holds mu F times the mean distance from the centre of its contact, two thirds of
    the radius where that is a disc (Howe and Cutkosky, Practical force-motion models for sliding
    manipulation, Int. J. Robotics Research 15(6), 1996).
    """
    radius = scene.physics.pad_patch_radius
    tip = 15.0 * np.concatenate([np.eye(3), -np.eye(3)])
    cases = [
        ("a face", workshop.box("face", (0.04, 0.02, 0.04), SLUGGISH), (PAD_WIDTH, PAD_HEIGHT)),
        ("a bar", workshop.box("bar", BAR, SLUGGISH), (PAD_WIDTH, BAR[2])),
    ]
    if radius > 0:
        point = workshop.part("point", h.convex(tip), SLUGGISH)
        held = _held_torque(scene, point, radius)
        yield near("torque that pads hold at a point", "2 mu F r, r the patch radius", "N m", *held, 0.1)
    for name, part, contact in cases:
        half = math.hypot(*contact) / 2
        expected, measured = _held_torque(scene, part, half)
        yield near(
            f"torque that pads hold on {name}", "2 mu F d/2, d the contact's diagonal", "N m",
            expected, measured, 0.1,
        )  # fmt: skip
        uniform = _uniform_moment(scene.physics, contact)
        yield near(
            f"the same, of that under uniform pressure, {name}", "d/2 by the contact's mean radius", "1",
            expected / uniform, measured / uniform, 0.1,
        )  # fmt: skip


def _held_torque(scene: BodyScene, part: Part, lever: float) -> tuple[float, float]:
    """Torque that the pads hold on a body, N m: by the formula with a lever in m, and in the simulation."""
    expected = 2 * scene.physics.friction_pad_part * scene.physics.finger_force * lever
    scene.pinch(part)
    scene.body.disable_gravity = True
    for share in np.arange(0.7, 1.6, 0.02):
        before = scene.pose_in_hand()
        scene.twist([0.0, share * expected, 0.0], 0.05)
        if abs(turn_about(before, scene.pose_in_hand(), 1)) > math.radians(0.3):
            return expected, float(share) * expected
    return expected, math.inf


def _uniform_moment(physics: Physics, contact: tuple[float, float]) -> float:
    """Friction moment of both pads on a rectangular contact under uniform pressure, N m."""
    a, b = contact
    u, v = np.meshgrid(np.linspace(-a / 2, a / 2, 201), np.linspace(-b / 2, b / 2, 201))
    return 2 * physics.friction_pad_part * physics.finger_force * float(np.hypot(u, v).mean())


def wedge(scene: BodyScene, workshop: Workshop) -> Iterator[Check]:
    """A wedge that widens below the pads: their lower edges hold it, or squeeze it out."""
    friction = math.degrees(math.atan(scene.physics.friction_pad_part))
    angles = np.arange(math.floor(friction) - 5.0, friction + 6.0)
    out = next((angle for angle in angles if _squeezed_out(scene, workshop, math.radians(angle))), math.inf)
    yield within(
        "half angle of a wedge that pads squeeze out", "atan(mu): friction angle", "deg",
        friction, float(out), 2.0,
    )  # fmt: skip


def _squeezed_out(scene: BodyScene, workshop: Workshop, angle: float) -> bool:
    slope, half = 1e3 * math.tan(angle), 10.0
    # Cross-section over (y, z), z from the pads' lower edge: as wide as `half` says at z = 0, millimetres.
    low, high = -8.0, 6.0
    corners = [(half - slope * 1e-3 * z, z) for z in (low, high)]
    points = np.array([[x, side * y, z] for x in (-15, 15) for y, z in corners for side in (-1, 1)])
    part = workshop.part(f"wedge-{angle:.4f}", h.convex(points), 0.2)
    scene.pinch(part, (0.0, 0.0, 1e-3 * workshop.centroid(part)[2] - PAD_BELOW))
    scene.body.disable_gravity = True
    scene.step(0.2)
    return float(scene.env.motion.gap()[0]) < 2e-3 * half - 1e-3


def centring(scene: BodyScene, workshop: Workshop) -> Iterator[Check]:
    """A block off centre, and one that lies turned, end aligned with the pads."""
    block = workshop.block()
    x, y = scene.env.region_centre
    z = BLOCK[2] / 2
    outcome = scene.grasp(block, (x, y + 0.012, z))
    shift = 1e3 * float(outcome["displacement"][1])
    yield within("shift of a block 12 mm off centre", "to the middle", "mm", -12.0, shift, 0.15)
    outcome = scene.grasp(block, (x, y, z), 0.3)
    turn = math.degrees(float(outcome["displacement"][3]))
    name = "turn of a block that lies turned by 0.3 rad"
    yield within(name, "flat against the pads", "deg", -math.degrees(0.3), turn, 0.3)
    rng = np.random.default_rng(0)
    errors = []
    for _ in range(BLOCKS):
        turn = float(rng.uniform(-0.5, 0.5))
        dx, dy = rng.uniform(-0.007, 0.007, 2)
        # One after the other in the same scene, as the collector does it.
        outcome = scene.grasp(block, (x + dx, y + dy, z), turn, fresh=False)
        errors.append(abs(math.degrees(float(outcome["displacement"][3]) + turn)))
    yield Check(
        name=f"greatest angle of {BLOCKS} random blocks", formula="flat against the pads", unit="deg",
        expected=0.0, measured=float(np.max(errors)), low=0.0, high=0.3,
    )  # fmt: skip
    outcome = scene.grasp(block, (x, y, z))
    yield Check(
        name="overlap of pads and a block", formula="none", unit="mm", expected=0.0,
        measured=1e3 * float(outcome["penetration"]), low=0.0, high=100 * MAX_PENETRATION,
    )  # fmt: skip


def mirroring(scene: BodyScene, workshop: Workshop) -> Iterator[Check]:
    """An L-shaped block, and its mirror image at the hand's planes: displacements are mirror images, too.

    Of chaotic grasps some differ: the median is compared. It is not zero, as which corners PhysX takes for
    the anchors of friction depends on the order of the corners; it may be as large as a difference of
    settings that counts as none (`mskgrasp.validate.config.Margins`).
    """
    bracket = h.block(-20, 20, -6, 6, -10, 10) + h.block(8, 20, 6, 18, -10, 10)
    starts = np.random.default_rng(3).uniform((-0.006, -0.006, -0.5), (0.006, 0.006, 0.5), (MIRRORED, 3))
    plain = _displacements(scene, workshop.part("bracket", bracket, 0.1), starts)
    for axis, plane, flip in (("y", "between the pads", (1, -1, -1)), ("x", "across them", (-1, 1, -1))):
        image = workshop.part(f"bracket-{axis}", bracket.mirrored(axis), 0.1)
        mirrored = _displacements(scene, image, starts * flip)
        difference = mirrored * np.array([*flip[:2], 1, -1]) - plain
        both = np.isfinite(difference).all(axis=1)
        same = float((np.isfinite(mirrored).all(axis=1) == np.isfinite(plain).all(axis=1)).mean())
        way = float(np.median(np.linalg.norm(difference[both, :3], axis=1))) if both.any() else math.inf
        turn = float(np.median(np.abs(wrap_angle(difference[both, 3])))) if both.any() else math.inf
        for what, unit, value, most in (
            ("displacement", "mm", 1e3 * way, 0.25),
            ("turn", "deg", math.degrees(turn), 0.1),
        ):
            yield Check(
                name=f"{what} of a grasp mirrored at the plane {plane}", formula="the mirror image (median)",
                unit=unit, expected=0.0, measured=value, low=0.0, high=most,
            )  # fmt: skip
        yield Check(
            name=f"success of a grasp mirrored at the plane {plane}", formula="the same", unit="1",
            expected=1.0, measured=same, low=1 - 1.5 / MIRRORED, high=1.0,
        )  # fmt: skip


def _displacements(scene: BodyScene, part: Part, starts: np.ndarray) -> np.ndarray:
    """Displacements (n, 4) from starts (n, 3), x, y and turn seen from the hand; NaN where not successful."""
    x, y = scene.env.region_centre
    found = []
    for k, (dx, dy, turn) in enumerate(starts):
        outcome = scene.grasp(part, (x + dx, y + dy, 0.01), float(turn), fresh=k == 0)
        found.append(outcome["displacement"])
    return np.stack(found)
