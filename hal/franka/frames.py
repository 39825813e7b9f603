"""Conversion of libfranka's poses.

libfranka writes homogeneous matrices as 16 numbers, columns first, in metres; its Python wrappers give
quaternions as x y z w, which are not used: a matrix has no ambiguous order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from hal.errors import NotConnected
from hal.hand import Load
from mskgrasp.core.geometry import Pose
from mskgrasp.core.panda_kinematics import TCP_OFFSET

_TURN = math.cos(math.pi / 4)
F_T_EE = np.array([[_TURN, _TURN, 0, 0], [-_TURN, _TURN, 0, 0], [0, 0, 1, TCP_OFFSET], [0, 0, 0, 1.0]])
"""The Franka Hand's TCP in the flange: turned by -45 degrees, 0.1034 m out (Franka Hand's datasheet)."""
_POSITION_TOLERANCE = 0.5e-3
_ROTATION_TOLERANCE = 2e-3
_SHORT = 1e-4
"""A shorter shift or turn has no direction, m or rad."""
_ALONG = 1e-3
"""A line this close to an axis is along it, rad: off by 0.03 mm at 0.25 m/s."""


def matrix_from_columns(values: Sequence[float]) -> np.ndarray:
    """(4, 4) of libfranka's 16 numbers."""
    return np.asarray(values, dtype=np.float64).reshape((4, 4), order="F")


def pose_from_columns(values: Sequence[float]) -> Pose:
    """``T_a_b`` of libfranka's 16 numbers, quaternion w x y z."""
    return Pose.from_matrix(matrix_from_columns(values))


def load_in_flange(load: Load) -> tuple[list[float], list[float]]:
    """Centre of mass (3,) in the flange, metres, and inertia (9,) in its axes, column-major, of a load."""
    turn = F_T_EE[:3, :3]
    centre = turn @ np.asarray(load.centre_tcp) + F_T_EE[:3, 3]
    inertia = turn @ np.asarray(load.inertia) @ turn.T
    return centre.tolist(), inertia.flatten(order="F").tolist()


def tool_along(start: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Turn (4, 4) of the frame at ``start`` that puts an axis on the line from there to ``goal``.

    What of the rotation is across the line gets an axis, too. It turns as little as possible: not at all for
    a descent of a vertical hand, or where the axes lie so already.

    Args:
        start: (4, 4) pose in the base.
        goal: (4, 4) pose in the base.
    """
    way = start[:3, :3].T @ (goal[:3, 3] - start[:3, 3])
    turn = Rotation.from_matrix(start[:3, :3].T @ goal[:3, :3]).as_rotvec()
    first, second = (way, turn) if np.linalg.norm(way) > _SHORT else (turn, np.zeros(3))
    tool = np.eye(4)
    if np.linalg.norm(first) < _SHORT:
        return tool
    nearest = int(np.abs(first).argmax())
    axis = np.sign(first[nearest]) * np.eye(3)[nearest]
    swing = _least_turn(axis, first)
    across = swing.inv().apply(second)
    across[nearest] = 0.0
    spin = Rotation.identity()
    if np.linalg.norm(across) > _ALONG:
        other = int(np.abs(across).argmax())
        spin = _least_turn(np.sign(across[other]) * np.eye(3)[other], across)
    tool[:3, :3] = (swing * spin).as_matrix()
    return tool


def _least_turn(axis: np.ndarray, direction: np.ndarray) -> Rotation:
    """Turn of a unit vector onto a direction less than a right angle away; none where it is there."""
    normal = np.cross(axis, direction / np.linalg.norm(direction))
    sine = float(np.linalg.norm(normal))
    if sine < _ALONG:
        return Rotation.identity()
    return Rotation.from_rotvec(normal / sine * math.asin(sine))


def check_end_effector(f_t_ee: Sequence[float]) -> None:
    """Refuse a robot whose end effector is not the Franka Hand's: every pose would be wrong.

    Raises:
        NotConnected: Names the configured end effector and where to change it.
    """
    found = matrix_from_columns(f_t_ee)
    distance = float(np.abs(found[:3, 3] - F_T_EE[:3, 3]).max())
    if distance > _POSITION_TOLERANCE or np.abs(found[:3, :3] - F_T_EE[:3, :3]).max() > _ROTATION_TOLERANCE:
        turn = math.degrees(math.atan2(found[1, 0], found[0, 0]))
        where = ", ".join(f"{value:.4f}" for value in found[:3, 3])
        raise NotConnected(
            f"the robot's end effector is at ({where}) m turned by {turn:.0f} degrees; this program needs "
            f"the Franka Hand at (0.0000, 0.0000, {TCP_OFFSET:.4f}) m, -45 degrees: choose it in Desk, "
            "Settings, End Effector"
        )
