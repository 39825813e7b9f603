"""Rigid poses and rotations, for numpy arrays and torch tensors.

Every function broadcasts over leading axes, returns new arrays of the type of its arguments, and mutates
nothing. Quaternions are ``quat_wxyz``; ``T_a_b`` is the pose of b in a.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from array_api_compat import array_namespace

Array = Any  # a numpy array or a torch tensor; this package must not import torch for an annotation


def wrap_angle(angle: Array) -> Array:
    """Wrap angles in radians to [-pi, pi)."""
    return _wrap(angle, 2 * np.pi)


def wrap_half_turn(angle: Array) -> Array:
    """Wrap angles in radians to [-pi/2, pi/2): a parallel jaw looks the same after half a turn."""
    return _wrap(angle, np.pi)


def _wrap(angle: Array, period: float) -> Array:
    if isinstance(angle, (int, float)):
        angle = np.asarray(angle, dtype=np.float64)
    wrapped = (angle + period / 2) % period - period / 2
    # Rounding can turn the modulo of a tiny negative number into the period itself.
    return array_namespace(wrapped).where(wrapped >= period / 2, wrapped - period, wrapped)


def components(vectors: Array) -> Sequence[Array]:
    """Views (...) of the last axis of vectors (..., k), one by one."""
    if hasattr(vectors, "unbind"):
        return vectors.unbind(-1)
    return [
        vectors[..., i] for i in range(vectors.shape[-1])
    ]  # takes a quarter of the time of numpy's unstack


def joined(parts: Sequence[Array]) -> Array:
    """Stack k arrays (...) along a new last axis, (..., k); the inverse of `components`."""
    if hasattr(parts[0], "unbind"):
        return array_namespace(*parts).stack(list(parts), axis=-1)
    return np.concatenate([part[..., None] for part in parts], axis=-1)  # takes half of the time of stack


def quat_multiply(left_wxyz: Array, right_wxyz: Array) -> Array:
    """Hamilton product of quaternions (..., 4)."""
    w1, x1, y1, z1 = components(left_wxyz)
    w2, x2, y2, z2 = components(right_wxyz)
    return joined(
        [
            w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
            w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
            w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
            w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
        ]
    )


def quat_conjugate(quat_wxyz: Array) -> Array:
    """The inverse of unit quaternions (..., 4)."""
    w, x, y, z = components(quat_wxyz)
    return joined([w, -x, -y, -z])


def quat_rotate(quat_wxyz: Array, points: Array) -> Array:
    """Points (..., 3) rotated by unit quaternions (..., 4)."""
    w, x, y, z = components(quat_wxyz)
    px, py, pz = components(points)
    # Both cross products written out: for a single pose, numpy's own takes four times as long.
    cx, cy, cz = y * pz - z * py, z * px - x * pz, x * py - y * px
    return joined(
        [
            px + 2 * (w * cx + (y * cz - z * cy)),
            py + 2 * (w * cy + (z * cx - x * cz)),
            pz + 2 * (w * cz + (x * cy - y * cx)),
        ]
    )


def quat_about_z(angle: Array) -> Array:
    """Rotations by ``angle`` radians (...) about z, as quaternions (..., 4)."""
    xp = array_namespace(angle)
    zero = xp.zeros_like(angle)
    return joined([xp.cos(angle / 2), zero, zero, xp.sin(angle / 2)])


def twist_and_swing(quat_wxyz: Array) -> tuple[Array, Array]:
    """Split rotations into a turn about z and a tilt away from z.

    The rotation is ``swing * twist`` with the twist about z. At a tilt of exactly 180 degrees the twist
    is undefined and reported as 0.

    Args:
        quat_wxyz: Unit quaternions (..., 4).

    Returns:
        twist: Signed angle about z (...), radians in [-pi, pi).
        swing: Angle by which z is tilted (...), radians in [0, pi].
    """
    xp = array_namespace(quat_wxyz)
    w, x, y, z = components(quat_wxyz)
    twist = wrap_angle(2 * xp.atan2(z, w))
    swing = 2 * xp.atan2(xp.sqrt(x * x + y * y), xp.sqrt(w * w + z * z))
    return twist, swing


def twist_and_swing_between(before: Pose, after: Pose) -> tuple[Array, Array]:
    """`twist_and_swing` of the rotation that turns one pose into another, in the axes of their frame."""
    return twist_and_swing(quat_multiply(after.quat_wxyz, quat_conjugate(before.quat_wxyz)))


def swing_vector(quat_wxyz: Array) -> Array:
    """Rotation vectors (..., 2), radians about x and y, of what remains when the twist about z is removed.

    Args:
        quat_wxyz: Unit quaternions (..., 4), split as in `twist_and_swing`.
    """
    xp = array_namespace(quat_wxyz)
    w, x, y, z = components(quat_wxyz)
    # quat * conjugate(twist), multiplied out, times the length of its part along w.
    along_x, along_y = x * w - y * z, x * z + y * w
    length = xp.sqrt(along_x * along_x + along_y * along_y)
    _, swing = twist_and_swing(quat_wxyz)
    scale = swing / xp.where(length > 0, length, xp.ones_like(length))
    return joined([along_x * scale, along_y * scale])


def rotation_angle(quat_wxyz: Array) -> Array:
    """Angles (...) of the rotations of unit quaternions (..., 4), radians in [0, pi]."""
    xp = array_namespace(quat_wxyz)
    w, x, y, z = components(quat_wxyz)
    return 2 * xp.atan2(xp.sqrt(x * x + y * y + z * z), xp.abs(w))


def quat_from_matrix(rotation: np.ndarray) -> np.ndarray:
    """Quaternions (..., 4), w >= 0, of rotation matrices (..., 3, 3)."""
    from scipy.spatial.transform import Rotation

    rotation = np.asarray(rotation, dtype=np.float64)
    quat = Rotation.from_matrix(rotation.reshape(-1, 3, 3)).as_quat(canonical=True, scalar_first=True)
    return quat.reshape(rotation.shape[:-2] + (4,))


def quat_to_matrix(quat_wxyz: Array) -> Array:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    xp = array_namespace(quat_wxyz)
    w, x, y, z = components(quat_wxyz)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return xp.stack([xp.stack(row, axis=-1) for row in rows], axis=-2)


@dataclass(frozen=True, kw_only=True)
class Pose:
    """Rigid poses: ``T_a_b`` holds b's origin and orientation as seen from a.

    Attributes:
        position: (..., 3), metres.
        quat_wxyz: (..., 4), unit quaternions.
    """

    position: Array
    quat_wxyz: Array

    @classmethod
    def identity(cls) -> Pose:
        """The identity pose, in double precision."""
        return cls(position=np.zeros(3), quat_wxyz=np.array([1.0, 0.0, 0.0, 0.0]))

    @classmethod
    def from_matrix(cls, matrix: np.ndarray) -> Pose:
        """Poses of homogeneous matrices (..., 4, 4)."""
        matrix = np.asarray(matrix, dtype=np.float64)
        return cls(position=matrix[..., :3, 3], quat_wxyz=quat_from_matrix(matrix[..., :3, :3]))

    @classmethod
    def from_vector(cls, vector: Array) -> Pose:
        """Poses of vectors (..., 7): x y z qw qx qy qz."""
        return cls(position=vector[..., :3], quat_wxyz=vector[..., 3:])

    @classmethod
    def translation(cls, position: Array) -> Pose:
        """The pose at a position (3,) in the axes of its frame."""
        return cls(position=position, quat_wxyz=np.array([1.0, 0.0, 0.0, 0.0]))

    def __getitem__(self, index: int) -> Pose:
        """One of several poses."""
        return Pose(position=self.position[index], quat_wxyz=self.quat_wxyz[index])

    def as_vector(self) -> Array:
        """(..., 7): x y z qw qx qy qz."""
        xp = array_namespace(self.position)
        shape = np.broadcast_shapes(tuple(self.position.shape[:-1]), tuple(self.quat_wxyz.shape[:-1]))
        return xp.concat(
            [
                xp.broadcast_to(self.position, shape + (3,)),
                xp.broadcast_to(self.quat_wxyz, shape + (4,)),
            ],
            axis=-1,
        )

    def as_matrix(self) -> np.ndarray:
        """(..., 4, 4) homogeneous matrices."""
        rotation = quat_to_matrix(np.asarray(self.quat_wxyz, dtype=np.float64))
        matrix = np.zeros(rotation.shape[:-2] + (4, 4))
        matrix[..., :3, :3] = rotation
        matrix[..., :3, 3] = self.position
        matrix[..., 3, 3] = 1.0
        return matrix

    def __matmul__(self, other: Pose) -> Pose:
        """``T_a_c = T_a_b @ T_b_c``."""
        return Pose(
            position=self.apply(other.position),
            quat_wxyz=quat_multiply(self.quat_wxyz, other.quat_wxyz),
        )

    def inverse(self) -> Pose:
        """``T_b_a`` of ``T_a_b``."""
        conjugate = quat_conjugate(self.quat_wxyz)
        return Pose(position=-quat_rotate(conjugate, self.position), quat_wxyz=conjugate)

    def apply(self, points_b: Array) -> Array:
        """Points (..., 3) of frame b, expressed in frame a."""
        return quat_rotate(self.quat_wxyz, points_b) + self.position


def pose_distance(a: Pose, b: Pose) -> tuple[float, float]:
    """Distance between the origins of two single poses, metres, and the angle between them, radians."""
    between = a.inverse() @ b
    return float(np.linalg.norm(b.position - a.position)), float(rotation_angle(between.quat_wxyz))


def straight_line(start: Pose, goal: Pose, shares: np.ndarray) -> Pose:
    """Poses (k,) on the straight line between two poses, turning at a constant rate the shorter way.

    Args:
        start: The pose at share 0.
        goal: The pose at share 1.
        shares: (k,) in [0, 1].
    """
    from scipy.spatial.transform import Rotation, Slerp

    ends = Rotation.from_quat(np.stack([start.quat_wxyz, goal.quat_wxyz]), scalar_first=True)
    shares = np.asarray(shares, dtype=np.float64)
    return Pose(
        position=start.position + shares[:, None] * (goal.position - start.position),
        quat_wxyz=Slerp([0, 1], ends)(np.clip(shares, 0, 1)).as_quat(scalar_first=True),
    )


def pixel_rays(shape: Sequence[int], intrinsics: np.ndarray) -> np.ndarray:
    """Points (h, w, 3) of the pixels of a depth image (h, w) at depth 1, in the camera's optical frame.

    Args:
        shape: Rows and columns.
        intrinsics: (3, 3) pinhole matrix in pixels.
    """
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    return np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(intrinsics).T
