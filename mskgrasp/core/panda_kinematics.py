"""Kinematics of the Franka Panda (and of the FR3, which shares its geometry) with the Franka Hand.

Numpy arrays and torch tensors alike, and without torch for numpy: the computer of a real robot need not
have it. Parameters: Franka Control Interface documentation, "Denavit-Hartenberg parameters" (Craig's
convention), end effector turned by -45 degrees and moved by 0.1034 m (Franka Hand).
"""

from __future__ import annotations

import math
from functools import lru_cache
from types import ModuleType

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
    frames = xp.stack(joint_frames(q), axis=-3)
    tip = frames[..., 7, :3, 3]
    axes, origins = (xp.moveaxis(frames[..., :7, :3, column], -1, -2) for column in (2, 3))
    linear = xp.linalg.cross(axes, tip[..., None] - origins, axis=-2)
    return frames[..., 7, :, :], xp.concat([linear, axes], axis=-2)


def joint_frames(q: Array) -> list[Array]:
    """Frames of the seven joints, then of the TCP, in the base: eight arrays (..., 4, 4).

    Args:
        q: (..., 7) joint angles, radians.
    """
    xp = array_namespace(q)
    of_cosine, of_sine, fixed = _link_terms(xp, q.dtype, device(q))
    hand = xp.full((*q.shape[:-1], 1), -math.pi / 4, dtype=q.dtype, device=device(q))
    angles = xp.concat([q, hand], axis=-1)[..., None, None]
    links = xp.cos(angles) * of_cosine + xp.sin(angles) * of_sine + fixed
    frame = links[..., 0, :, :]
    frames = [frame]
    for joint in range(1, 8):
        frame = frame @ links[..., joint, :, :]
        frames.append(frame)
    return frames


def forward_pose(q: np.ndarray) -> Pose:
    """``T_base_tcp`` (...) at joints (..., 7), radians."""
    return Pose.from_matrix(forward(q)[0])


@lru_cache
def _link_terms(xp: ModuleType, dtype: object, at: object) -> tuple[Array, Array, Array]:
    """Factors of cosine and sine of a link's angle in its transform, and the rest: arrays (8, 4, 4)."""
    terms = np.zeros((3, 8, 4, 4))
    of_cosine, of_sine, fixed = terms
    for link, (a, d, alpha) in enumerate(
        zip((*DH_A, 0.0), (*DH_D, FLANGE_OFFSET + TCP_OFFSET), (*DH_ALPHA, 0.0), strict=True)
    ):
        c, s = math.cos(alpha), math.sin(alpha)
        of_cosine[link, :3, :2] = [[1, 0], [0, c], [0, s]]
        of_sine[link, :3, :2] = [[0, -1], [c, 0], [s, 0]]
        fixed[link] = [[0, 0, 0, a], [0, 0, -s, -d * s], [0, 0, c, d * c], [0, 0, 0, 1]]
    of_cosine, of_sine, fixed = (xp.asarray(term, dtype=dtype, device=at) for term in terms)
    return of_cosine, of_sine, fixed


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
