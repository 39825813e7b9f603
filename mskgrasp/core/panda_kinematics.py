"""Kinematics of the Franka Panda with its hand, batched.

Parameters: Franka Control Interface documentation, "Denavit-Hartenberg parameters" (Craig's
convention), end effector turned by -45 degrees and moved by 0.1034 m (Franka Hand).
"""

from __future__ import annotations

import math

import torch
from array_api_compat import array_namespace
from torch import Tensor

from mskgrasp.core.geometry import Array, components, joined

JOINT_LOWER = (-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973)
JOINT_UPPER = (2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973)
HOME = (0.0, math.pi / 8, 0.0, -5 * math.pi / 8, 0.0, 3 * math.pi / 4, math.pi / 4)
"""Arm joints at rest: the hand points down in front of the base."""

_A = (0.0, 0.0, 0.0, 0.0825, -0.0825, 0.0, 0.088)
_D = (0.333, 0.0, 0.316, 0.0, 0.384, 0.0, 0.0)
_ALPHA = (0.0, -math.pi / 2, math.pi / 2, math.pi / 2, -math.pi / 2, math.pi / 2, math.pi / 2)
_FLANGE = 0.107
_TCP = 0.1034
_UPPER_ARM = math.hypot(0.316, 0.0825)
_FOREARM = math.hypot(0.384, 0.0825)


def forward(q: Tensor) -> tuple[Tensor, Tensor]:
    """Pose of the TCP and the geometric Jacobian.

    Args:
        q: (..., 7) joint angles, radians.

    Returns:
        T_base_tcp: (..., 4, 4).
        jacobian: (..., 6, 7), linear rows above angular ones, base frame.
    """
    shape = q.shape[:-1]
    frame = torch.eye(4, dtype=q.dtype, device=q.device).expand(*shape, 4, 4)
    axes, origins = [], []
    for joint in range(7):
        frame = frame @ _link(q[..., joint], _A[joint], _D[joint], _ALPHA[joint])
        axes.append(frame[..., :3, 2])
        origins.append(frame[..., :3, 3])
    angle = torch.full(shape, -math.pi / 4, dtype=q.dtype, device=q.device)
    frame = frame @ _link(angle, 0.0, _FLANGE + _TCP, 0.0)
    tip = frame[..., :3, 3]
    columns = [
        torch.cat([torch.linalg.cross(axis, tip - origin), axis], dim=-1)
        for axis, origin in zip(axes, origins, strict=True)
    ]
    return frame, torch.stack(columns, dim=-1)


def _link(theta: Tensor, a: float, d: float, alpha: float) -> Tensor:
    c, s = torch.cos(theta), torch.sin(theta)
    ca, sa = math.cos(alpha), math.sin(alpha)
    zero, one = torch.zeros_like(theta), torch.ones_like(theta)
    rows = [
        [c, -s, zero, a * one],
        [s * ca, c * ca, -sa * one, -d * sa * one],
        [s * sa, c * sa, ca * one, d * ca * one],
        [zero, zero, zero, one],
    ]
    return torch.stack([torch.stack(row, dim=-1) for row in rows], dim=-2)


def top_down(grasps: Array) -> tuple[Array, Array]:
    """Joint angles that put the hand, pointing straight down, at grasps; closed form.

    With joints 3 and 5 at zero the arm stays in a vertical plane through the base axis: joint 1 turns
    that plane, joints 2 and 4 are a two-link arm, joint 6 makes the hand vertical and joint 7 turns it.

    Args:
        grasps: numpy or torch, (..., 4) x, y, z, theta in the base frame, metres and radians.

    Returns:
        q: (..., 7) radians; meaningless where not reachable.
        reachable: (...) bool, within the arm's length and its joint limits.
    """
    xp = array_namespace(grasps)
    x, y, z, theta = components(grasps)
    q1 = xp.atan2(y, x)
    radius = xp.sqrt(x * x + y * y) - _A[6]
    height = z + _FLANGE + _TCP - _D[0]
    distance2 = radius * radius + height * height
    cosine = (distance2 - _UPPER_ARM**2 - _FOREARM**2) / (2 * _UPPER_ARM * _FOREARM)
    within = abs(cosine) <= 1
    bend = xp.acos(xp.clip(cosine, -1, 1))
    # The elbow's offsets turn both links by a constant angle against the joint's zero.
    offset = math.atan2(0.0825, 0.316) + math.atan2(0.0825, 0.384)
    q4 = -(bend + offset)
    lead = xp.atan2(radius, height)
    inner = xp.atan2(_FOREARM * xp.sin(bend), _UPPER_ARM + _FOREARM * xp.cos(bend))
    q2 = lead - inner - math.atan2(0.0825, 0.316)
    q6 = q2 - q4
    q7 = math.pi / 4 + q1 - theta
    zero = xp.zeros_like(q1)
    turning = ((0, q1), (1, q2), (3, q4), (5, q6), (6, q7))
    for joint, angle in turning:
        within = within & (angle >= JOINT_LOWER[joint]) & (angle <= JOINT_UPPER[joint])
    return joined([q1, q2, zero, q4, zero, q6, q7]), within


def track(path: Tensor, start: Tensor, *, iterations: int = 8) -> tuple[Tensor, Tensor]:
    """Joint angles along a path of poses, each solved from the one before (damped least squares).

    Args:
        path: (k, 4, 4) ``T_base_tcp``, consecutive poses close to each other.
        start: (7,) joints near the first pose.
        iterations: Newton steps a pose.

    Returns:
        q: (k, 7) radians.
        error: (k,) what is left, metres and radians mixed; above 1e-4 the pose was not reached.
    """
    q, solved, errors = start.clone(), [], []
    damping = 1e-6 * torch.eye(6, dtype=q.dtype, device=q.device)
    for target in path:
        for _ in range(iterations):
            pose, jacobian = forward(q)
            residual = _pose_error(pose, target)
            if float(residual.norm()) < 1e-7:
                break
            q = q + jacobian.T @ torch.linalg.solve(jacobian @ jacobian.T + damping, residual)
        solved.append(q)
        errors.append(_pose_error(forward(q)[0], target).norm())
    return torch.stack(solved), torch.stack(errors)


def _pose_error(pose: Tensor, target: Tensor) -> Tensor:
    """(6,) translation and rotation vector from a pose to its target, base frame."""
    turn = target[:3, :3] @ pose[:3, :3].T
    skew = torch.stack([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = skew.norm() / 2
    angle = torch.atan2(sine, (torch.trace(turn) - 1) / 2)
    axis = skew / (2 * sine).clamp(min=1e-12)
    return torch.cat([target[:3, 3] - pose[:3, 3], angle * axis])
