"""Panda with the Franka Hand as a MuJoCo model: kinematics, inertias, collision shapes, actuators.

Link frames are those of the Denavit-Hartenberg parameters in `mskgrasp.core.panda_kinematics`, which are also
the frames of the published inertias.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from hal.mujoco.config import MujocoPhysics
from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.core.panda_kinematics import (
    DH_A,
    DH_ALPHA,
    DH_D,
    FLANGE_OFFSET,
    JOINT_LOWER,
    JOINT_UPPER,
    TCP_OFFSET,
)

TORQUE_LIMIT = (87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0)
"""Greatest torques of the joints, N m; Franka Emika Panda datasheet."""
FINGER_STIFFNESS = 4000.0
"""Stiffness of the drive of the fingers' opening, N/m; decides how soon pads press with the full force."""
FINGER_DAMPING = 50.0
"""Damping of the same drive, N s/m: critical, with the armature of two fingers."""
ROBOT, OTHERS = 2, 1
"""Collision classes: the robot's shapes do not collide with each other."""
SEEN, HIDDEN = 1, 3
"""Groups of shapes that the camera sees, and that it does not."""
FINGERS = ("left_finger", "right_finger")
HAND_BODIES = ("hand", *FINGERS)
_WHITE, _GREY, _BLACK = (0.9, 0.9, 0.9, 1.0), (0.7, 0.7, 0.72, 1.0), (0.15, 0.15, 0.16, 1.0)


@dataclass(frozen=True)
class Inertia:
    """Mass and inertia of a link in its own frame.

    Attributes:
        mass: kg.
        centre: (3,) centre of mass, metres.
        moments: ixx, iyy, izz, ixy, ixz, iyz about the centre of mass, kg m^2.
    """

    mass: float
    centre: tuple[float, float, float]
    moments: tuple[float, float, float, float, float, float]

    def matrix(self) -> np.ndarray:
        """(3, 3) about the centre of mass, kg m^2."""
        xx, yy, zz, xy, xz, yz = self.moments
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


LINKS = (
    Inertia(4.970684, (0.003875, 0.002081, -0.04762),
            (0.70337, 0.70661, 0.009117, -0.000139, 0.006772, 0.019169)),
    Inertia(0.646926, (-0.003141, -0.02872, 0.003495),
            (0.007962, 0.02811, 0.025995, -0.003925, 0.010254, 0.000704)),
    Inertia(3.228604, (0.027518, 0.039252, -0.066502),
            (0.037242, 0.036155, 0.01083, -0.004761, -0.011396, -0.012805)),
    Inertia(3.587895, (-0.05317, 0.104419, 0.027454),
            (0.025853, 0.019552, 0.028323, 0.007796, -0.001332, 0.008641)),
    Inertia(1.225946, (-0.011953, 0.041065, -0.038437),
            (0.035549, 0.029474, 0.008627, -0.002117, -0.004037, 0.000229)),
    Inertia(1.666555, (0.060149, -0.014117, -0.010517),
            (0.001964, 0.004354, 0.005433, 0.000109, -0.001158, 0.000341)),
    Inertia(0.735522, (0.010517, -0.004252, 0.061597),
            (0.012516, 0.010027, 0.004815, -0.000428, -0.001196, -0.000741)),
)  # fmt: skip
"""Links 1 to 7: Gaz et al., Dynamic Identification of the Franka Emika Panda Robot With Retrieval of Feasible
Parameters Using Penalty-Based Optimization, RA-L 4(4), 2019 (doi 10.1109/LRA.2019.2931248); its values as in
franka_description."""
HAND = Inertia(0.73, (-0.01, 0.0, 0.03), (0.001, 0.0025, 0.0017, 0.0, 0.0, 0.0))
"""Franka Hand without its fingers: franka_description; libfranka's default end effector has 0.73 kg, too."""
FINGER = Inertia(0.015, (0.0, 0.0, 0.0), (2.375e-6, 2.375e-6, 7.5e-7, 0.0, 0.0, 0.0))
"""A finger: franka_description."""

_CAPSULES = (
    ((0.0, 0.0, -0.1915), 0.06, 0.283),
    ((0.0, 0.0, 0.0), 0.06, 0.12),
    ((0.0, 0.0, -0.145), 0.06, 0.15),
    ((0.0, 0.0, 0.0), 0.06, 0.12),
    ((0.0, 0.0, -0.26), 0.06, 0.1),
    ((0.0, 0.0, -0.03), 0.05, 0.08),
    ((0.0, 0.0, 0.01), 0.04, 0.14),
)
"""Centre, radius and length between the ends of each link's capsule, after the capsules that Franka's
controller checks against self-collision (franka_description); they represent the covers in images, too."""

_FIRST_TO_COLLIDE = 4
"""Index of the first link that may come near a part; those before it stay over the table."""
_ONLY_SEEN = dict(contype=0, conaffinity=0, group=SEEN)

_PALM = (
    (-0.026, 0.0316, -0.104, 0.094),
    (0.006, 0.0316, -0.104, 0.094),
    (0.054, 0.0196, -0.101, 0.1005),
    (0.061, 0.0178, -0.0985, 0.0985),
    (0.064, 0.0169, -0.0955, 0.0955),
    (0.066, 0.0145, -0.093, 0.093),
)
"""The hand's body in its frame, from its top down: z, half of its length in x, and its bounds in y. It has
the shape of the hull of the hand's collision mesh (franka_description), which narrows towards the fingers."""
_FINGER_BOXES = (
    ((0.0, 0.0185, 0.011), (0.022, 0.015, 0.020), 0.0),
    ((0.0, 0.0068, 0.0022), (0.022, 0.0088, 0.0038), 0.0),
    ((0.0, 0.0159, 0.02835), (0.0175, 0.007, 0.0235), math.pi / 6),
)
"""Mount, carriage and diagonal of the left finger: centre, size and turn about x, finger frame (the collision
boxes of franka_description)."""
_PAD = ((0.0, 0.00758, 0.04525), (0.0175, 0.0152, 0.0185))
"""Rubber tip of the left finger: centre and size (franka_description)."""
_FINGER_Z = 0.0584
"""z of the fingers' frames in the hand's frame, metres."""


def add_panda(spec: mujoco.MjSpec, physics: MujocoPhysics) -> None:
    """Add arm, hand and fingers at the world's origin.

    Joints: ``joint1`` to ``joint7``, ``finger1``, ``finger2``. Actuators: a torque for each joint of the
    arm, and ``opening``, whose control is the wanted distance of the pads. Site: ``tcp``.
    """
    body = spec.worldbody
    frames = zip(DH_A, DH_D, DH_ALPHA, LINKS, _CAPSULES, strict=True)
    for i, (a, d, alpha, inertia, capsule) in enumerate(frames):
        body = body.add_body(
            name=f"link{i + 1}",
            pos=[a, -math.sin(alpha) * d, math.cos(alpha) * d],
            quat=_about_x(alpha),
            explicitinertial=True,
        )
        _set_inertia(body, inertia)
        body.add_joint(
            name=f"joint{i + 1}",
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=[0, 0, 1],
            limited=mujoco.mjtLimited.mjLIMITED_TRUE,
            range=[JOINT_LOWER[i], JOINT_UPPER[i]],
        )
        centre, radius, length = capsule
        shape = _robot_shape(physics) if i >= _FIRST_TO_COLLIDE else _ONLY_SEEN
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            pos=centre,
            size=[radius, length / 2, 0],
            rgba=_WHITE,
            **shape,
        )
        spec.add_actuator(
            name=f"torque{i + 1}",
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            target=f"joint{i + 1}",
            ctrllimited=mujoco.mjtLimited.mjLIMITED_TRUE,
            ctrlrange=[-TORQUE_LIMIT[i], TORQUE_LIMIT[i]],
        )
    hand = body.add_body(
        name="hand",
        pos=[0, 0, FLANGE_OFFSET],
        quat=[math.cos(math.pi / 8), 0, 0, -math.sin(math.pi / 8)],
        explicitinertial=True,
    )
    _set_inertia(hand, HAND)
    spec.add_mesh(
        name="palm",
        uservert=[value for z, x, *ends in _PALM for y in ends for side in (-x, x) for value in (side, y, z)],
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX,
    )
    hand.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="palm", rgba=_GREY, **_robot_shape(physics))
    hand.add_site(name="tcp", pos=[0, 0, TCP_OFFSET])
    for number, (name, side) in enumerate(zip(FINGERS, (1.0, -1.0), strict=True), start=1):
        _add_finger(hand, name, number, side, physics)
    _add_finger_drive(spec, physics)


def _add_finger(hand: mujoco.MjsBody, name: str, number: int, side: float, physics: MujocoPhysics) -> None:
    finger = hand.add_body(name=name, pos=[0, 0, _FINGER_Z], explicitinertial=True)
    _set_inertia(finger, FINGER)
    finger.add_joint(
        name=f"finger{number}",
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[0, side, 0],
        armature=physics.finger_armature,
        limited=mujoco.mjtLimited.mjLIMITED_TRUE,
        range=[0, MAX_OPENING / 2],
        solref_limit=[2 * physics.step_s, 1],
        solimp_limit=[0.99, 0.999, 0.0001, 0.5, 2],
    )
    for (x, y, z), size, turn in _FINGER_BOXES:
        finger.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[x, side * y, z],
            quat=_about_x(side * turn),
            size=np.array(size) / 2,
            rgba=_GREY,
            **_robot_shape(physics),
        )
    (x, y, z), (width, depth, height) = _PAD
    n = physics.pad_pieces
    for i in range(n):
        for j in range(n):
            finger.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=[x + ((i + 0.5) / n - 0.5) * width, side * y, z + ((j + 0.5) / n - 0.5) * height],
                size=[width / n / 2, depth / 2, height / n / 2],
                rgba=_BLACK,
                **_robot_shape(physics),
            )


def _add_finger_drive(spec: mujoco.MjSpec, physics: MujocoPhysics) -> None:
    """One motor moves both fingers, as in the real hand: coupled, and driven by their opening."""
    spec.add_equality(
        type=mujoco.mjtEq.mjEQ_JOINT,
        name1="finger1",
        name2="finger2",
        data=[0, 1, *[0] * 10],
        solref=[2 * physics.step_s, 1],
        solimp=[0.99, 0.999, 0.0001, 0.5, 2],
    )
    tendon = spec.add_tendon(name="opening")
    tendon.wrap_joint("finger1", 1)
    tendon.wrap_joint("finger2", 1)
    spec.add_actuator(
        name="opening",
        trntype=mujoco.mjtTrn.mjTRN_TENDON,
        target="opening",
        gainprm=[FINGER_STIFFNESS, *[0] * 9],
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        biasprm=[0, -FINGER_STIFFNESS, -FINGER_DAMPING, *[0] * 7],
        forcelimited=mujoco.mjtLimited.mjLIMITED_TRUE,
        forcerange=[-1, 1],  # set by each command
    )


def _robot_shape(physics: MujocoPhysics) -> dict:
    """Contacts of the robot: its friction applies to all that it touches, and a pad resists turning."""
    mu = physics.friction_pad_part
    return dict(
        contype=ROBOT,
        conaffinity=OTHERS,
        group=SEEN,
        priority=2,
        condim=4,
        friction=[mu, mu * physics.pad_patch_radius, 0],
        **stiff(physics),
    )


def stiff(physics: MujocoPhysics) -> dict:
    """Contact parameters of all shapes."""
    return dict(solref=[physics.contact_time_s, 1], solimp=[*physics.contact_impedance, 0.5, 2])


def _set_inertia(body: mujoco.MjsBody, inertia: Inertia) -> None:
    body.mass = inertia.mass
    body.ipos = inertia.centre
    body.fullinertia = inertia.moments


def _about_x(angle: float) -> list[float]:
    return [math.cos(angle / 2), math.sin(angle / 2), 0, 0]
