"""Kinematics of the Panda and of the FR3, which share their geometry, in plain numpy.

The machine beside a real robot has no simulator, so `panda_kinematics` (batched torch) is out of reach;
a test holds both to the same poses. Parameters: Franka Control Interface documentation,
"Denavit-Hartenberg parameters" (Craig's convention), end effector of the Franka Hand.
"""

from __future__ import annotations

import math

import numpy as np

from mskgrasp.core.geometry import Pose

TCP_OFFSET = 0.1034
"""From the flange to the TCP along the hand, metres (libfranka's default end effector, Franka Hand)."""

_A = (0.0, 0.0, 0.0, 0.0825, -0.0825, 0.0, 0.088)
_D = (0.333, 0.0, 0.316, 0.0, 0.384, 0.0, 0.0)
_ALPHA = (0.0, -math.pi / 2, math.pi / 2, math.pi / 2, -math.pi / 2, math.pi / 2, math.pi / 2)
_FLANGE = 0.107
_READY = np.array([0.0, math.pi / 8, 0.0, -5 * math.pi / 8, 0.0, 3 * math.pi / 4, math.pi / 4])
_SOLVED = 1e-4
_DAMPING = 1e-6 * np.eye(6)


def forward(joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pose of the TCP and the geometric Jacobian.

    Args:
        joints: (7,) radians.

    Returns:
        T_base_tcp: (4, 4).
        jacobian: (6, 7), linear rows above angular ones, base frame.
    """
    frame = np.eye(4)
    axes, origins = np.empty((7, 3)), np.empty((7, 3))
    for joint in range(7):
        frame = frame @ _link(float(joints[joint]), _A[joint], _D[joint], _ALPHA[joint])
        axes[joint], origins[joint] = frame[:3, 2], frame[:3, 3]
    frame = frame @ _link(-math.pi / 4, 0.0, _FLANGE + TCP_OFFSET, 0.0)
    return frame, np.concatenate([np.cross(axes, frame[:3, 3] - origins), axes], axis=1).T


def forward_pose(joints: np.ndarray) -> Pose:
    """``T_base_tcp`` at joints (7,), radians."""
    return Pose.from_matrix(forward(joints)[0])


def track(path: np.ndarray, start: np.ndarray, *, iterations: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """Joint angles along a path of poses, each solved from the one before (damped least squares).

    Args:
        path: (k, 4, 4) ``T_base_tcp``, consecutive poses close to each other.
        start: (7,) joints near the first pose, radians.
        iterations: Newton steps a pose.

    Returns:
        joints: (k, 7) radians.
        error: (k,) what is left, metres and radians mixed; above 1e-4 the pose was not reached.
    """
    joints = np.array(start, dtype=np.float64)
    solved, errors = np.empty((len(path), 7)), np.empty(len(path))
    for k, target in enumerate(path):
        pose, jacobian = forward(joints)
        residual = _pose_error(pose, target)
        for _ in range(iterations):
            if np.linalg.norm(residual) < 1e-7:
                break
            joints = joints + jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + _DAMPING, residual)
            pose, jacobian = forward(joints)
            residual = _pose_error(pose, target)
        solved[k], errors[k] = joints, np.linalg.norm(residual)
    return solved, errors


def within(joints: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> bool:
    """Whether joints (..., 7) lie within limits (7,), radians."""
    return bool(((joints >= lower) & (joints <= upper)).all())


def reachable(T_base_tcp: Pose, lower: np.ndarray, upper: np.ndarray) -> bool:
    """Whether the pose is reached within joint limits from the usual ready pose, elbow up, hand down."""
    joints, error = track(T_base_tcp.as_matrix()[None], _READY, iterations=40)
    return bool(error[0] < _SOLVED) and within(joints, lower, upper)


def solved(error: np.ndarray) -> bool:
    """Whether every pose of `track` was reached."""
    return bool((error < _SOLVED).all())


def _link(theta: float, a: float, d: float, alpha: float) -> np.ndarray:
    c, s, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
    return np.array(
        [
            [c, -s, 0.0, a],
            [s * ca, c * ca, -sa, -d * sa],
            [s * sa, c * sa, ca, d * ca],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _pose_error(pose: np.ndarray, target: np.ndarray) -> np.ndarray:
    """(6,) translation and rotation vector from a pose to its target, base frame."""
    turn = target[:3, :3] @ pose[:3, :3].T
    skew = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = float(np.linalg.norm(skew)) / 2
    angle = math.atan2(sine, (float(np.trace(turn)) - 1) / 2)
    return np.concatenate([target[:3, 3] - pose[:3, 3], angle * skew / max(2 * sine, 1e-12)])
