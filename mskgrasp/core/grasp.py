"""Grasps, their frames, and the displacement of a part in the hand.

A `Grasp` holds x, y, z in metres and theta in radians, in the base frame, theta in [-pi/2, pi/2). At
theta = 0 the fingers close along the base's y. Two frames share the point (x, y, z):

* tcp, libfranka's end effector: z points out of the hand (down), y is the closing direction,
* grasp: z up, turned by theta; displacements are given along its axes.

The functions serve inner loops: they take the same four numbers as an array (..., 4), `Grasp.as_vector`, of
numpy or torch, and broadcast over leading axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from array_api_compat import array_namespace

from mskgrasp.core.geometry import (
    Array,
    Pose,
    components,
    joined,
    quat_about_z,
    quat_conjugate,
    quat_multiply,
    quat_rotate,
    swing_vector,
    twist_and_swing_between,
    wrap_angle,
)

PAD_REACH = 0.0095
"""Reach of the finger pads below the TCP, metres (collision box of the Panda hand's pads)."""
PAD_WIDTH, PAD_HEIGHT = 0.0175, 0.0185
"""Rubber tip of a finger, along and up the pads, metres (franka_description)."""
TABLE_CLEARANCE = 0.001
"""Least distance between the pads and the table at the grasp, metres."""
MAX_OPENING = 0.08
"""Distance between the pads of the open hand, metres (Franka Hand datasheet)."""
FINGER_HALF_WIDTH = 0.011
"""Half the width, along the pads, of the widest collision box of a finger, metres (Panda hand)."""
FINGER_THICKNESS = 0.026
"""Distance from a pad's face to the back of the finger, metres."""
PALM_HEIGHT = 0.0374
"""Height of the lower face of the hand's collision hull over the TCP, metres."""
SAME_HAND = 2e-4
"""Greatest difference of a dimension by which two hands count as the same, metres."""
HAND_GEOMETRY = {
    "pad_reach": PAD_REACH,
    "max_opening": MAX_OPENING,
    "finger_half_width": FINGER_HALF_WIDTH,
    "finger_thickness": FINGER_THICKNESS,
    "palm_height": PALM_HEIGHT,
}
"""The dimensions of the hand above, as stored in datasets, metres."""
MIN_GAP = 0.5e-3
"""Pads with a smaller gap hold nothing, metres."""
MIN_RISE = 0.8
"""Least share of the lift height by which a held part has risen."""
HOLD_S = 0.2
"""Time for which a lifted part is held before it is judged, seconds."""
MAX_DISPLACEMENT = 0.05
"""Largest displacement of a held part in the hand, metres; an attempt with a larger one is discarded."""
TILT_LIMIT = float(np.radians(2.0))
"""A part that tilts by more in the hand counts as tilted, radians."""
EJECTED_DISTANCE = 0.05
"""A part that ends this far from its initial position, and not in the hand, was ejected, metres."""
FAILURES = ("none", "missed", "slipped", "ejected", "collided", "unsettled", "unreachable")
"""Reasons of failures, by code: a shard stores the index into this tuple. The last two are no failures of a
grasp: ``unsettled``, the part was not at rest before (only datasets of simulation version 1 hold such), and
``unreachable``, the arm cannot execute the grasp, so that it was not tried (no dataset holds any)."""


@dataclass(frozen=True, kw_only=True)
class Grasp:
    """Top-down grasps in the base frame; batched like `Pose`.

    At theta = 0 the fingers close along the base's y.

    Attributes:
        position: (..., 3) of the TCP, metres.
        theta: (...) radians; a jaw cannot tell theta from theta + pi.
    """

    position: Array
    theta: Array

    @classmethod
    def from_vector(cls, vector: Array) -> Grasp:
        """Grasps of vectors (..., 4): x y z theta."""
        if vector.shape[-1:] != (4,):
            raise ValueError(f"a grasp is x y z theta, shape (..., 4), got shape {tuple(vector.shape)}")
        return cls(position=vector[..., :3], theta=vector[..., 3])

    def as_vector(self) -> Array:
        """(..., 4): x y z theta."""
        xp = array_namespace(self.position)
        return xp.concat([self.position, xp.asarray(self.theta)[..., None]], axis=-1)

    def __len__(self) -> int:
        """Number of grasps along the first axis."""
        return len(self.position[..., 0])

    def __getitem__(self, rows: Any) -> Grasp:
        """Some of a batch of grasps."""
        return Grasp(position=self.position[rows], theta=self.theta[rows])

    def raised(self, height: Array) -> Grasp:
        """The same grasps, ``height`` metres higher."""
        xp = array_namespace(self.position)
        up = xp.asarray([0.0, 0.0, 1.0], dtype=self.position.dtype)
        return Grasp(position=self.position + height * up, theta=self.theta)

    @property
    def T_base_grasp(self) -> Pose:
        """Grasp frames: z up, y the closing direction."""
        return pose_base_grasp(self.as_vector())

    @property
    def T_base_tcp(self) -> Pose:
        """TCP frames: z out of the hand, y the closing direction."""
        return pose_base_tcp(self.as_vector())


def lowest_grasp_z(table_z: float, clearance: float = TABLE_CLEARANCE) -> float:
    """The lowest z, metres, of a grasp whose pads keep clear of a table at ``table_z``."""
    return table_z + PAD_REACH + clearance


def pose_base_grasp(grasp: Array) -> Pose:
    """``T_base_grasp`` of grasps (..., 4): z up, y the closing direction."""
    return Pose(position=grasp[..., :3], quat_wxyz=quat_about_z(grasp[..., 3]))


def pose_base_tcp(grasp: Array) -> Pose:
    """``T_base_tcp = Trans(x, y, z) Rz(theta) Rx(pi)`` of grasps (..., 4)."""
    xp = array_namespace(grasp)
    half = grasp[..., 3] / 2
    zero = xp.zeros_like(half)
    # Rz(theta) Rx(pi), multiplied out: (cos, 0, 0, sin) * (0, 1, 0, 0).
    quat_wxyz = joined([zero, xp.cos(half), xp.sin(half), zero])
    return Pose(position=grasp[..., :3], quat_wxyz=quat_wxyz)


def object_displacement(T_tcp_obj_before: Pose, T_tcp_obj_after: Pose) -> tuple[Array, Array]:
    """Displacement of a part in the hand between before and after the grasp, and its tilt.

    Args:
        T_tcp_obj_before: The part in the commanded TCP frame, at rest before the grasp.
        T_tcp_obj_after: The part in the measured TCP frame, lifted and still.

    Returns:
        displacement: (..., 4) dx, dy, dz (metres, along the axes of the grasp frame) of the part's
            origin and dtheta (radians in [-pi, pi)), the twist about the grasp frame's z.
        tilt: (...) the swing that remains when the twist is removed, radians.
    """
    before, after = (_tcp_to_grasp_frame(pose) for pose in (T_tcp_obj_before, T_tcp_obj_after))
    xp = array_namespace(before.position)
    dtheta, tilt = twist_and_swing_between(before, after)
    moved = after.position - before.position
    return xp.concat([moved, dtheta[..., None]], axis=-1), tilt


def swing_in_hand(T_tcp_obj_before: Pose, T_tcp_obj_after: Pose) -> Array:
    """Swing (..., 2) of a part in the hand: the rotation vector about the grasp frame's x and y, radians.

    Its length is the tilt of `object_displacement`, which takes the same poses.
    """
    before, after = (_tcp_to_grasp_frame(pose) for pose in (T_tcp_obj_before, T_tcp_obj_after))
    return swing_vector(quat_multiply(after.quat_wxyz, quat_conjugate(before.quat_wxyz)))


def _tcp_to_grasp_frame(T_tcp_obj: Pose) -> Pose:
    """Turn a pose in the TCP frame (z down) by Rx(pi) into the grasp frame (z up)."""
    x, y, z = components(T_tcp_obj.position)
    qw, qx, qy, qz = components(T_tcp_obj.quat_wxyz)
    # Multiplied out: (0, 1, 0, 0) * (qw, qx, qy, qz).
    return Pose(position=joined([x, -y, -z]), quat_wxyz=joined([-qx, qw, -qz, qy]))


def centre_in_grasp_frame(centre_base: Array, grasp: Array) -> Array:
    """The object centre (..., 3), base frame, seen from the grasp frames of grasps (..., 4)."""
    return pose_base_grasp(grasp).inverse().apply(centre_base)


def to_grasp_displacement(displacement: Array, centre_grasp: Array) -> Array:
    """Displacement of a part's point to grasp displacement: how the hand moved in the part's frame.

    ``Delta-g = (c - Rz(-dtheta) (c + d), -dtheta)``, the inverse of `to_object_displacement`. It describes
    the rigid motion: every point of the part gives the same, up to the tilt.

    Args:
        displacement: (..., 4) dx, dy, dz, dtheta of that point in the hand.
        centre_grasp: (..., 3) c, the point in the grasp frame before the grasp, metres.

    Returns:
        (..., 4) metres and radians, along the axes of the planned grasp frame.
    """
    xp = array_namespace(displacement)
    turn = -displacement[..., 3]
    moved = centre_grasp - quat_rotate(quat_about_z(turn), centre_grasp + displacement[..., :3])
    return xp.concat([moved, wrap_angle(turn)[..., None]], axis=-1)


def to_object_displacement(grasp_displacement: Array, centre_grasp: Array) -> Array:
    """Grasp displacement to the displacement of a part's point; the inverse of `to_grasp_displacement`.

    Args:
        grasp_displacement: (..., 4), metres and radians.
        centre_grasp: (..., 3) c, the point in the grasp frame before the grasp, metres.

    Returns:
        (..., 4) dx, dy, dz, dtheta of that point in the hand, along the axes of the grasp frame.
    """
    xp = array_namespace(grasp_displacement)
    dtheta = -grasp_displacement[..., 3]
    back = quat_rotate(quat_about_z(dtheta), centre_grasp - grasp_displacement[..., :3])
    return xp.concat([back - centre_grasp, wrap_angle(dtheta)[..., None]], axis=-1)


@dataclass(frozen=True, kw_only=True)
class PartView:
    """A part as detected in the depth image: all that a network's input is made from.

    Attributes:
        centre_base: (3,) centre of the bounding box at mid height, base frame, metres.
        T_base_box: The box's frame: origin at its centre on the table, axes x and y along the camera's
            image axes, z up.
        size: (3,) extent of the box along those axes, metres; size[2] is the part's height.
        gyration_radius: RMS distance of the part's visible points from the centre seen from above, m.
        table_z: Height of the table, base frame, metres.
        table_offset: Height at which a noisy camera sees the table above ``table_z``, metres; 0 if exact.
    """

    centre_base: np.ndarray
    T_base_box: Pose
    size: np.ndarray
    gyration_radius: float
    table_z: float
    table_offset: float = 0.0


def sample_grasps(view: PartView, n: int, rng: np.random.Generator) -> np.ndarray:
    """Grasps uniform in the part's bounding box, z from the table clearance to the part's top.

    A part lower than the lowest grasp is grasped at that height. theta is uniform in [-pi/2, pi/2).

    Args:
        view: The detected part.
        n: Number of grasps.
        rng: Source of randomness.

    Returns:
        (n, 4) float64, base frame, metres and radians.
    """
    unit = rng.random((n, 4))
    on_table = np.zeros((n, 3))
    on_table[:, :2] = (unit[:, :2] - 0.5) * view.size[:2]
    grasps = np.empty((n, 4))
    grasps[:, :3] = view.T_base_box.apply(on_table)
    lowest = lowest_grasp_z(view.table_z)
    highest = max(lowest, view.table_z + float(view.size[2]))
    grasps[:, 2] = lowest + unit[:, 2] * (highest - lowest)
    grasps[:, 3] = (unit[:, 3] - 0.5) * np.pi
    return grasps
