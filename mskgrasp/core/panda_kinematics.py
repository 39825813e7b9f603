"""Kinematics of the Franka Panda (and of the FR3, which shares its geometry) with the Franka Hand.

Numpy arrays and torch tensors alike, and without torch for numpy: the computer of a real robot need not
have it. Parameters: Franka Control Interface documentation, "Denavit-Hartenberg parameters" (Craig's
convention), end effector turned by -45 degrees and moved by 0.1034 m (Franka Hand).
"""

from __future__ import annotations

import math

import numpy as np
from array_api_compat import array_namespace, device

from mskgrasp.core.geometry import Array, Pose, components, joined

JOINT_LOWER = (-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973)
JOINT_UPPER = (2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973)
HOME = (0.0, math.pi / 8, 0.0, -5 * math.pi / 8, 0.0, 3 * math.pi / 4, math.pi / 4)
"""Arm joints at rest: the hand points down in front of the base."""
TCP_OFFSET = 0.1034
"""From the flange to the TCP along the hand, metres (libfranka's default end effector, Franka Hand)."""
POSE_TOLERANCE = 1e-4
"""A pose that `track` misses by more, metres and radians mixed, is out of reach."""

DH_A = (0.0, 0.0, 0.0, 0.0825, -0.0825, 0.0, 0.088)
"""Link lengths of the seven joints, metres."""
DH_D = (0.333, 0.0, 0.316, 0.0, 0.384, 0.0, 0.0)
"""Link offsets, metres."""
DH_ALPHA = (0.0, -math.pi / 2, math.pi / 2, math.pi / 2, -math.pi / 2, math.pi / 2, math.pi / 2)
"""Link twists, radians."""
FLANGE_OFFSET = 0.107
"""From the last joint's frame to the flange, metres."""
_UPPER_ARM = math.hypot(0.316, 0.0825)
_FOREARM = math.hypot(0.384, 0.0825)


def forward(q: Array) -> tuple[Array, Array]:
    """Pose of the TCP and the geometric Jacobian.

    Args:
        q: (..., 7) joint angles, radians.

    Returns:
        T_base_tcp: (..., 4, 4).
        jacobian: (..., 6, 7), linear rows above angular ones, base frame.
    """
    xp = array_namespace(q)
    frames = joint_frames(q)
    frame = frames[7]
    tip = frame[..., :3, 3]
    axes = xp.stack([joint_frame[..., :3, 2] for joint_frame in frames[:7]], axis=-1)
    origins = xp.stack([joint_frame[..., :3, 3] for joint_frame in frames[:7]], axis=-1)
    linear = xp.linalg.cross(axes, tip[..., None] - origins, axis=-2)
    return frame, xp.concat([linear, axes], axis=-2)


def joint_frames(q: Array) -> list[Array]:
    """Frames of the seven joints, then of the TCP, in the base: eight arrays (..., 4, 4).

    Args:
        q: (..., 7) joint angles, radians.
    """
    xp = array_namespace(q)
    angles = [*components(q), xp.full(q.shape[:-1], -math.pi / 4, dtype=q.dtype, device=device(q))]
    links = _links(
        xp.stack(angles, axis=-1), (*DH_A, 0.0), (*DH_D, FLANGE_OFFSET + TCP_OFFSET), (*DH_ALPHA, 0.0)
    )
    frame = links[..., 0, :, :]
    frames = [frame]
    for joint in range(1, 8):
        frame = frame @ links[..., joint, :, :]
        frames.append(frame)
    return frames


def forward_pose(q: np.ndarray) -> Pose:
    """``T_base_tcp`` (...) at joints (..., 7), radians."""
    return Pose.from_matrix(forward(q)[0])


def _links(theta: Array, a: tuple[float, ...], d: tuple[float, ...], alpha: tuple[float, ...]) -> Array:
    """(..., k, 4, 4) transforms of links at angles (..., k)."""
    xp = array_namespace(theta)
    c, s = xp.cos(theta), xp.sin(theta)

    def constant(values: list[float]) -> Array:
        vector = xp.asarray(values, dtype=theta.dtype, device=device(theta))
        return xp.broadcast_to(vector, theta.shape)

    zero, one = xp.zeros_like(theta), xp.ones_like(theta)
    ca, sa = constant([math.cos(angle) for angle in alpha]), constant([math.sin(angle) for angle in alpha])
    d_sa = constant([-offset * math.sin(angle) for offset, angle in zip(d, alpha, strict=True)])
    d_ca = constant([offset * math.cos(angle) for offset, angle in zip(d, alpha, strict=True)])
    entries = [
        *(c, -s, zero, constant(list(a))),
        *(s * ca, c * ca, -sa, d_sa),
        *(s * sa, c * sa, ca, d_ca),
        *(zero, zero, zero, one),
    ]
    return xp.reshape(xp.stack(entries, axis=-1), (*theta.shape, 4, 4))


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
    radius = xp.sqrt(x * x + y * y) - DH_A[6]
    height = z + FLANGE_OFFSET + TCP_OFFSET - DH_D[0]
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


def track(path: Array, start: Array, *, iterations: int = 8) -> tuple[Array, Array]:
    """Joint angles along a path of poses, each solved from the one before (damped least squares).

    Args:
        path: (k, 4, 4) ``T_base_tcp``, consecutive poses close to each other.
        start: (7,) joints near the first pose, radians.
        iterations: Newton steps a pose.

    Returns:
        q: (k, 7) radians.
        error: (k,) remaining error, metres and radians mixed; above `POSE_TOLERANCE` a pose was not reached.
    """
    xp = array_namespace(path, start)
    q, solved, errors = start, [], []
    damping = 1e-6 * xp.eye(6, dtype=q.dtype, device=device(q))
    for target in path:
        pose, jacobian = forward(q)
        residual = _pose_error(pose, target)
        for _ in range(iterations):
            if float(xp.linalg.vector_norm(residual)) < 1e-7:
                break
            q = q + jacobian.T @ xp.linalg.solve(jacobian @ jacobian.T + damping, residual)
            pose, jacobian = forward(q)
            residual = _pose_error(pose, target)
        solved.append(q)
        errors.append(xp.linalg.vector_norm(residual))
    return xp.stack(solved), xp.stack(errors)


def _pose_error(pose: Array, target: Array) -> Array:
    """(6,) translation and rotation vector from a pose to its target, base frame."""
    xp = array_namespace(pose, target)
    turn = target[:3, :3] @ pose[:3, :3].T
    skew = xp.stack([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = xp.linalg.vector_norm(skew) / 2
    angle = xp.atan2(sine, (xp.linalg.trace(turn) - 1) / 2)
    axis = skew / xp.clip(2 * sine, 1e-12, None)
    return xp.concat([target[:3, 3] - pose[:3, 3], angle * axis])


def within_limits(q: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> bool:
    """Whether all joints (..., 7) lie within limits (7,), radians."""
    return bool(((q >= lower) & (q <= upper)).all())


def reachable(T_base_tcp: Pose, lower: np.ndarray, upper: np.ndarray) -> bool:
    """Whether the pose is reached within joint limits (7,) from `HOME`: elbow up, hand down."""
    q, error = solve(T_base_tcp)
    return error < POSE_TOLERANCE and within_limits(q, lower, upper)


def solve(T_base_tcp: Pose) -> tuple[np.ndarray, float]:
    """Joints (7,) at which the hand is at a pose, from `HOME`: elbow up; and their remaining error."""
    q, error = track(T_base_tcp.as_matrix()[None], np.array(HOME), iterations=40)
    return q[0], float(error[0])
