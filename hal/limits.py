"""Limits of an arm's commands, checked before anything moves. Pure functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hal.errors import OutOfWorkspace
from hal.gripper import FRANKA_HAND, GripperSpec
from hal.keep_out import KeepOut
from mskgrasp.core.geometry import Pose, pose_distance, quat_rotate, straight_line
from mskgrasp.core.grasp import MIN_GAP, TABLE_CLEARANCE
from mskgrasp.core.panda_body import HAND_MASS, PAYLOAD

_STEP = 0.01
"""Greatest distance between two checked points of a straight motion, metres."""
_TURN = 0.02
"""Greatest turn of the hand between them, radians: a corner of the palm moves by 2 mm."""
_JOINT_STEP = 0.02
"""Greatest angle, summed over the joints, between two checked points of a joint motion, radians."""
TOUCH_DEPTH = 0.05
"""Depth under the table's stated height to which the pads may be moved in search of it, metres."""
_SLACK = 1e-3
"""Tolerance along a path, metres: an arm rests as exactly as its drives hold it."""
_UNIT = 1e-3

PAD_CORNER = 0.0575
"""Distance of the open pads' farthest corner from the hand's axis, metres."""


@dataclass(frozen=True, kw_only=True)
class ArmLimits:
    """Limits that every command is checked against before anything moves.

    Attributes:
        joint_lower: (n,) radians; the arm has n joints.
        joint_upper: (n,) radians.
        box_lower: (3,) the TCP stays inside this box, base frame, metres.
        box_upper: (3,) the other corner.
        table_z: Height of the table at `table_centre`, base frame, metres; the hand stays clear of it.
        max_force: Greatest gripper force, N.
        clearance: Least distance of the hand from the table, metres.
        table_slope: (2,) rise of the table along x and along y, metres a metre.
        table_centre: (2,) point at which the table is at ``table_z``, base frame, metres.
        keep_out: Space that no link enters, for an arm whose links are known (`hal.collisions`).
        closed_width: Pads at this distance or less hold nothing, metres.
        max_load: Greatest mass of a part in the hand, kg.
        gripper: Dimensions and ranges of the hand.
    """

    joint_lower: np.ndarray
    joint_upper: np.ndarray
    box_lower: np.ndarray
    box_upper: np.ndarray
    table_z: float
    max_force: float
    clearance: float = TABLE_CLEARANCE
    table_slope: np.ndarray = field(default_factory=lambda: np.zeros(2))
    table_centre: np.ndarray = field(default_factory=lambda: np.zeros(2))
    keep_out: tuple[KeepOut, ...] = ()
    closed_width: float = MIN_GAP
    max_load: float = PAYLOAD - HAND_MASS
    gripper: GripperSpec = FRANKA_HAND

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return len(self.joint_lower)

    def over_table(self, T_base_tcp: Pose) -> np.ndarray:
        """Distances (...) of the open hand's lowest corner from the table, metres; negative below it."""
        position, quat_wxyz = (
            np.asarray(value)[..., None, :] for value in (T_base_tcp.position, T_base_tcp.quat_wxyz)
        )
        corners = quat_rotate(quat_wxyz, self.gripper.corners) + position
        table = plane_height(corners[..., :2], self.table_z, self.table_slope, self.table_centre)
        return (corners[..., 2] - table).min(axis=-1)


def plane_height(
    xy: np.ndarray, z: float, slope: Sequence[float] | np.ndarray, centre: Sequence[float] | np.ndarray
) -> np.ndarray:
    """Heights (...) at points (..., 2) of a plane with a slope (2,) and the height ``z`` at a centre (2,)."""
    return z + (np.asarray(xy) - np.asarray(centre)) @ np.asarray(slope, dtype=np.float64)


def lowest_point(T_base_tcp: Pose) -> float:
    """Height of the lowest corner of the open Franka Hand, base frame, metres."""
    return float(T_base_tcp.apply(FRANKA_HAND.corners)[:, 2].min())


def check_target_joints(limits: ArmLimits, joints: np.ndarray) -> None:
    """Refuse joints (n,) outside their limits.

    Raises:
        OutOfWorkspace: Names the joint and its limits.
    """
    lower, upper = limits.joint_lower, limits.joint_upper
    if joints.shape != lower.shape or not np.isfinite(joints).all():
        raise OutOfWorkspace(f"joints must be {limits.n_joints} finite numbers, got {joints.tolist()}")
    outside = np.flatnonzero((joints < lower) | (joints > upper))
    if len(outside):
        i = outside[0]
        raise OutOfWorkspace(
            f"joint {i + 1} to {joints[i]:.3f} rad is outside {lower[i]:.3f} .. {upper[i]:.3f} rad"
        )


def check_target_pose(limits: ArmLimits, T_base_tcp: Pose) -> None:
    """Refuse a pose outside the box or too near the table.

    Raises:
        OutOfWorkspace: Names the value and its limits.
    """
    position, quat_wxyz = np.asarray(T_base_tcp.position), np.asarray(T_base_tcp.quat_wxyz)
    numbers = [*position.ravel(), *quat_wxyz.ravel()]
    if position.shape != (3,) or quat_wxyz.shape != (4,) or not np.isfinite(numbers).all():
        raise OutOfWorkspace(f"a target must be one pose of finite numbers, got {position.tolist()}")
    if abs(float(np.linalg.norm(quat_wxyz)) - 1) > _UNIT:
        raise OutOfWorkspace(f"a target's quaternion must have length 1, got {quat_wxyz.tolist()} (w x y z)")
    if _outside(limits, position) > 0:
        raise OutOfWorkspace(f"TCP target {shown(position)} m is outside the workspace {_box(limits)}")
    over = float(limits.over_table(T_base_tcp))
    if over < limits.clearance - 1e-6:
        raise OutOfWorkspace(
            f"TCP target z {position[2]:.4f} m would bring the hand {over * 1e3:.1f} mm over the table; it "
            f"must stay {limits.clearance * 1e3:g} mm above (here z >= "
            f"{position[2] - over + limits.clearance:.4f} m)"
        )


def touching(limits: ArmLimits) -> ArmLimits:
    """Limits of a motion that ends at a contact: it may go `TOUCH_DEPTH` below where the table should be."""
    lowest = min(float(limits.box_lower[2]), limits.table_z) - TOUCH_DEPTH
    return replace(
        limits,
        box_lower=np.array([*limits.box_lower[:2], lowest]),
        table_z=limits.table_z - TOUCH_DEPTH - limits.clearance,
    )


def check_line(limits: ArmLimits, start: Pose, goal: Pose) -> None:
    """Refuse a straight motion on which a tilting hand would touch the table.

    Raises:
        OutOfWorkspace: Names the place.
    """
    distance, angle = pose_distance(start, goal)
    n = 2 + int(max(distance / _STEP, angle / _TURN))
    _check_way(limits, straight_line(start, goal, np.linspace(0, 1, n)), "the straight line to this pose")


def check_joint_path(
    limits: ArmLimits, forward: Callable[[np.ndarray], Pose], start: np.ndarray, goal: np.ndarray
) -> None:
    """Refuse a joint motion that brings the hand to the table or out of the box.

    Args:
        limits: Limits of the arm.
        forward: ``T_base_tcp`` (k,) at joints (k, n).
        start: (n,) current joints, radians.
        goal: (n,) radians, within their limits.

    Raises:
        OutOfWorkspace: Names the place.
    """
    n = 2 + int(np.abs(goal - start).sum() / _JOINT_STEP)
    poses = forward(start + np.linspace(0, 1, n)[:, None] * (goal - start))
    end = poses.position[-1]
    if _outside(limits, end) > 0:
        raise OutOfWorkspace(
            f"these joints put the TCP at {shown(end)} m, outside the workspace {_box(limits)}"
        )
    _check_way(limits, poses, "the way to these joints")


def _check_way(limits: ArmLimits, poses: Pose, what: str) -> None:
    """Refuse poses (k,) that leave the limits; an arm guided out of them may return, but go no farther."""
    over = limits.over_table(poses)
    if over.min() < min(over[0], limits.clearance) - _SLACK:
        raise OutOfWorkspace(
            f"{what} brings the hand down to {limits.table_z + over.min():.3f} m; the table is at "
            f"{limits.table_z:g} m"
        )
    excess = _outside(limits, poses.position)
    if excess.max() > excess[0] + _SLACK:
        worst = poses.position[int(excess.argmax())]
        raise OutOfWorkspace(
            f"{what} passes {shown(worst)} m, outside the workspace {_box(limits)}; move there in steps, or "
            "guide the arm by hand into the middle of it"
        )


def _outside(limits: ArmLimits, position: np.ndarray) -> np.ndarray:
    """Distances (...) of positions (..., 3) from the box, metres; 0 inside."""
    beyond = np.maximum(limits.box_lower - position, position - limits.box_upper)
    return np.maximum(beyond.max(axis=-1), 0.0)


def shown(position: np.ndarray) -> str:
    """A position as text for messages, metres."""
    return "(" + ", ".join(f"{value:.3f}" for value in position) + ")"


def _box(limits: ArmLimits) -> str:
    return f"{np.round(limits.box_lower, 3).tolist()} .. {np.round(limits.box_upper, 3).tolist()} m"
