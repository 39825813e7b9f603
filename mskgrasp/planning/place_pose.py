"""Placing of a grasped part at a target, corrected by its displacement in the hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hal.cell import Cell
from hal.errors import MotionAborted, OutOfWorkspace
from hal.execute import APPROACH, PUT_DOWN, clear_height, let_go
from mskgrasp.core.geometry import (
    Pose,
    quat_about_z,
    quat_multiply,
    quat_rotate,
    twist_and_swing_between,
    wrap_angle,
)
from mskgrasp.core.grasp import Grasp, PartView
from mskgrasp.runtime.progress import note

EARLY = 0.007
"""Height above the target pose from which contact with the table counts as placed, metres."""
TAKEN_ALONG = 0.03
"""A part that is so much higher than it lay is still in the hand, which has risen farther, metres."""
_NEAR = 0.02
"""Height above the target pose from which the part is lowered slowly, metres; more than `EARLY`, so that
it meets the table slowly where it hangs lower than expected, too."""
_BELOW = 0.001
"""Distance below the height of the grasp to which a part is lowered at most until it touches, metres."""
_TOUCH_FORCE, _TOUCH_SPEED = 5.0, 0.02
"""Force that is the table's touch, N, and speed towards it, m/s."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """Target position and rotation of a part.

    Attributes:
        x: x of the part's centre, base frame, metres.
        y: The same.
        theta: Rotation of the part about the vertical from its initial pose, radians.
    """

    x: float
    y: float
    theta: float


def drop_of(grasp: Grasp, view: PartView, dtheta: float, swing: np.ndarray) -> float:
    """Compute how much lower the lowest corner of a part's box hangs because the part has swung, metres.

    Args:
        grasp: Grasp of the part, base frame.
        view: The part before the grasp.
        dtheta: Turn of the part in the hand, radians.
        swing: (2,) swing of the part in the hand, radians about x and y of the grasp frame; NaN: unknown.
    """
    angle = float(np.linalg.norm(swing))
    if not angle > 0:
        return 0.0
    half = np.asarray(view.size, dtype=np.float64) / 2
    corners = np.stack(np.meshgrid(*([-1.0, 1.0],) * 3, indexing="ij"), axis=-1).reshape(-1, 3) * half
    quat_grasp = grasp.T_base_grasp.inverse().quat_wxyz
    corners = quat_rotate(quat_multiply(quat_grasp, view.T_base_box.quat_wxyz), corners)
    swung = np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) / angle * swing, [0.0]])
    turn = quat_multiply(swung, quat_about_z(np.asarray(float(dtheta))))
    return max(0.0, -half[2] - float(quat_rotate(turn, corners)[:, 2].min()))


def place_pose(
    grasp: Grasp,
    displacement: np.ndarray,
    centre_base: np.ndarray,
    target: Target,
    lowest_grasp_z: Callable[[np.ndarray], np.ndarray],
    *,
    drop: float = 0.0,
) -> Grasp:
    """Compute the hand pose, as a grasp, at which the held part is at the target.

    In the grasp frame the part's centre is at c + d and is turned by dtheta, where c is the centre before the
    grasp and (d, dtheta) the displacement. The hand at (p, phi) has the centre at p + R(phi) (c + d) and the
    part rotated by phi - theta + dtheta from its initial pose; both are solved for p and phi.

    Args:
        grasp: Grasp of the part, base frame.
        displacement: (4,) of the centre, in the grasp frame; zeros place without correction.
        centre_base: (3,) the part's centre before the grasp, base frame, metres.
        target: Target of the part's centre.
        lowest_grasp_z: Gives the least z of grasps at points (..., 2), as `hal.Workspace.lowest_grasp_z`.
        drop: As `drop_of` computes it: the hand stays so much higher, metres.

    Returns:
        Base frame; theta is not wrapped to half a turn, which would turn the part.
    """
    displacement = np.asarray(displacement, dtype=np.float64)
    centre_grasp = grasp.T_base_grasp.inverse().apply(np.asarray(centre_base, dtype=np.float64))
    held = centre_grasp[:2] + displacement[:2]
    theta = wrap_angle(grasp.theta + target.theta - displacement[3])
    cos, sin = np.cos(theta), np.sin(theta)
    x = target.x - (cos * held[0] - sin * held[1])
    y = target.y - (sin * held[0] + cos * held[1])
    # A part that has sunk in the hand is held higher, one that has risen lower.
    # Where the table slopes it is not as high there.
    lowest = lowest_grasp_z(np.array([[x, y], grasp.position[:2]]))
    z = grasp.position[2] - displacement[2] + drop + PUT_DOWN + float(lowest[0] - lowest[1])
    z = max(z, float(lowest[0]))
    return Grasp(position=np.array([x, y, z]), theta=theta)


def place_error(before: Pose, after: Pose, centre_offset: np.ndarray, target: Target) -> tuple[float, float]:
    """Compute the distance of a placed part from its target, metres and radians.

    Args:
        before: ``T_base_obj`` before the grasp.
        after: ``T_base_obj`` after placing.
        centre_offset: (2,) the detected centre relative to the origin of obj, base axes, metres: the target
            is that of this point.
        target: Target of the centre.
    """
    turn = float(twist_and_swing_between(before, after)[0])
    cos, sin = np.cos(turn), np.sin(turn)
    x, y = centre_offset
    centre = after.position[:2] + [cos * x - sin * y, sin * x + cos * y]
    distance = float(np.hypot(*(centre - [target.x, target.y])))
    return distance, turned_by(turn, target)


def taken_along(lay: Pose, after: Pose) -> bool:
    """Whether a part went up with the hand that was to release it.

    Args:
        lay: ``T_base_obj`` before the grasp.
        after: ``T_base_obj`` once the hand has risen.
    """
    return bool(after.position[2] > lay.position[2] + TAKEN_ALONG)


def turned_by(turn: float, target: Target) -> float:
    """Compute the absolute difference of a part's rotation from the target's, radians."""
    return float(abs(wrap_angle(turn - target.theta)))


def displacement_of_point(displacement: np.ndarray, origin: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Convert a displacement (4,) of a part's origin to that of another point, in the grasp frame before.

    Args:
        displacement: (4,) of the origin.
        origin: (3,) metres.
        point: (3,) metres; the part's tilt is ignored.
    """
    cos, sin = np.cos(displacement[3]), np.sin(displacement[3])
    x, y, _ = np.asarray(point) - origin
    swept = np.array([cos * x - sin * y - x, sin * x + cos * y - y, 0.0, 0.0])
    return np.asarray(displacement, dtype=np.float64) + swept


def carry_height(cell: Cell, pose: Grasp, tallest: float = 0.0) -> float:
    """Height of the TCP at which the held part passes over everything, base frame, metres.

    Args:
        cell: The cell.
        pose: Pose of the hand at which the part stands on the table; it reaches as far below the TCP.
        tallest: Height of the tallest other thing over the table, metres.
    """
    z = float(pose.position[2])
    return max(clear_height(cell, tallest, below=z - cell.workspace.table_z), z + 0.02)


def check_place(cell: Cell, pose: Grasp, *, tallest: float = 0.0) -> None:
    """Refuse a pose that the arm cannot reach, before anything moves.

    Args:
        cell: The cell.
        pose: As `place_pose` gives it.
        tallest: Height of the tallest other thing over the table, metres.

    Raises:
        OutOfWorkspace: The arm cannot reach it, or the height at which it carries the part over all else.
    """
    cell.arm.check_pose(pose.T_base_tcp)
    cell.arm.check_pose(_above(cell, pose, tallest))


def _above(cell: Cell, pose: Grasp, tallest: float) -> Pose:
    x, y, _ = pose.position
    return replace(pose, position=np.array([x, y, carry_height(cell, pose, tallest)])).T_base_tcp


def place(
    cell: Cell,
    pose: Grasp,
    recover: Callable[[MotionAborted], None],
    *,
    drop: float = 0.0,
    opening: float | None = None,
    tallest: float = 0.0,
    part_height: float = 0.0,
    arrived: Callable[[], None] | None = None,
) -> None:
    """Move the held part to a pose, lower it until it touches the table, release it and retract.

    Where the way leads over something tall the hand rises straight first. A tilted part may touch the table
    before it is at the pose, which ends the motion; it is released there.

    Args:
        cell: The arm has lifted the part.
        pose: As `place_pose` gives it.
        recover: Lets the arm move again after that contact, or raises an error.
        drop: What `place_pose` was given: the part is lowered by as much at most, should it hang less low.
        opening: Opening that releases it, as in `hal.let_go`: `mskgrasp.planning.release.release_opening`.
        tallest: Height of the tallest other thing over the table, metres.
        part_height: Height of the part, over which the open hand rises, metres.
        arrived: Called once the part is there, before the fingers open.

    Raises:
        OutOfWorkspace: The pose is out of reach, or no straight line leads there; the part is in the hand.
        MotionAborted: The part touched something more than `EARLY` above the pose.
    """
    check_place(cell, pose, tallest=tallest)
    above, here = _above(cell, pose, tallest), cell.arm.state().T_base_tcp
    if here.position[2] < above.position[2] and above.position[2] > _usual_height(cell, pose):
        x, y, _ = here.position
        up = Pose(position=np.array([x, y, above.position[2]]), quat_wxyz=here.quat_wxyz)
        cell.arm.move_to_pose(up, speed=0.25)
    cell.arm.move_to_pose(above, speed=0.25)
    if pose.position[2] + _NEAR < above.position[2]:
        cell.arm.move_to_pose(pose.raised(_NEAR).T_base_tcp, speed=0.25)
    try:
        cell.arm.move_to_pose(pose.T_base_tcp, speed=0.1)
    except MotionAborted as error:
        if cell.arm.state().T_base_tcp.position[2] > pose.position[2] + EARLY:
            raise
        recover(error)
    else:
        _lower_to_touch(cell, pose, PUT_DOWN + drop + _BELOW, recover)
    if arrived is not None:
        arrived()
    let_go(cell, pose, opening=opening, tallest=max(tallest, part_height))


def _lower_to_touch(cell: Cell, pose: Grasp, by: float, recover: Callable[[MotionAborted], None]) -> None:
    """Lower the part until it touches the table, by so much at most, metres: a part that falls shifts.

    The pads stay clear of the table, whether the part touches it or not.
    """
    x, y, z = pose.position
    lowest = max(float(z) - by, float(cell.workspace.lowest_grasp_z(pose.position[:2])))
    if lowest >= z:
        return
    goal = replace(pose, position=np.array([x, y, lowest]))
    try:
        cell.arm.move_until_contact(goal.T_base_tcp, force=_TOUCH_FORCE, speed=_TOUCH_SPEED)
    except OutOfWorkspace as error:
        note(f"the part is let go above the table, not lowered to it: {error}")
    except MotionAborted as error:
        recover(error)


def _usual_height(cell: Cell, pose: Grasp) -> float:
    """Height over low things, which a lifted part has reached, or reaches on its way aside."""
    return max(cell.workspace.table_z + APPROACH, float(pose.position[2]) + 0.02)
