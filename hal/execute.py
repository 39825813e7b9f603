"""Motions of a grasp on any cell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hal.arm import JOINT_TOLERANCE, POSITION_TOLERANCE
from hal.camera import RgbdFrame
from hal.cell import Cell
from hal.errors import ArmInView, HandFull, MotionAborted, NotCalibrated, OutOfWorkspace, Stopped
from hal.hand import Load
from hal.sight import link_in_sight
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import HOLD_S, SAME_HAND, Grasp

APPROACH = 0.12
"""Least height over the table from which the straight descent begins, m; tall things raise it."""

OVER = 0.015
"""Distance at which the hand, and what it holds, passes over the tallest thing, m."""

AT_HOME = 0.02
"""Greatest error of a joint at which the arm counts as at home, rad: its hand is off by 1 cm at most."""

RETREAT = 0.05
"""Height by which the open hand first rises on its way home, so that it does not drag the part along, m."""

PUT_DOWN = 0.002
"""Height above that of the grasp at which a part is put down, or from which it is lowered to the touch, m."""

RELEASE = 0.02
"""Opening of the fingers, more than that of the grasp, that releases a part for certain, m."""

LEAST_RELEASE = 0.006
"""Opening of the fingers, more than that of the grasp, that barely releases a part, m."""


@dataclass(frozen=True, kw_only=True)
class GraspResult:
    """Outcome of a grasp as the arm measures it.

    Attributes:
        lifted: The fingers closed on something and the arm lifted it.
        holding: The fingers hold something after lift and hold, by `Arm.holds`.
        width: Distance of the pads after lift and hold, metres.
        T_base_tcp: Measured pose of the TCP after lift and hold.
        aborted: Reason if the motion ended early, else None; the arm then needs `recover`.
    """

    lifted: bool
    holding: bool
    width: float
    T_base_tcp: Pose
    aborted: str | None


def execute_grasp(cell: Cell, grasp: Grasp, *, tallest: float = 0.0, load: Load | None = None) -> GraspResult:
    """Open, approach, descend, close, lift and hold.

    Args:
        cell: Connected, without an error in force.
        grasp: A single one, base frame.
        tallest: Height of the tallest thing over the table, which the open hand passes over, metres.
        load: Mass and centre of the part, stated to the arm between closing and lift; None where unknown.

    Raises:
        NotCalibrated: The camera's pose was measured by hand; nothing moves.
        LoadTooHeavy: The arm cannot carry the part; nothing moves.
        OutOfWorkspace: A pose is refused before anything moves, or the way to one where it begins: the arm
            then stands over the part or at it, and may hold it.
        HalError: The arm was lost or stopped; a motion that met resistance is a result, not an error.
    """
    refuse_by_hand(cell)
    arm, lift = cell.arm, cell.workspace.lift_height
    above = above_grasp(cell, grasp, tallest=tallest)
    target, lifted = grasp.T_base_tcp, grasp.raised(lift).T_base_tcp
    if load is not None:
        arm.check_load(load.mass)
    for pose in (target, above, lifted):
        arm.check_pose(pose)
    try:
        arm.open_gripper()
        arm.move_to_pose(above, speed=0.4)
        arm.move_to_pose(target, speed=0.25)
        closed = arm.grasp(cell.workspace.grasp_force)
        if closed.holding:
            if load is not None:
                arm.set_load(load)
            arm.move_to_pose(lifted, speed=0.25)
            arm.wait(HOLD_S)
    except Stopped:
        raise
    except MotionAborted as error:
        state = arm.state()
        return GraspResult(
            lifted=False,
            holding=False,
            width=state.gripper_width,
            T_base_tcp=state.T_base_tcp,
            aborted=str(error),
        )
    state = arm.state()
    return GraspResult(
        lifted=closed.holding,
        holding=closed.holding and arm.holds(state),
        width=state.gripper_width,
        T_base_tcp=state.T_base_tcp,
        aborted=None,
    )


def refuse_by_hand(cell: Cell) -> None:
    """Refuse motions to what the camera sees while its pose is good to centimetres only.

    Raises:
        NotCalibrated: The camera's pose was measured by hand.
    """
    if cell.camera.by_hand:
        raise NotCalibrated(
            "the camera's pose was measured by hand, good to centimetres: nothing moves to what it sees; "
            "calibrate it (python -m hal.calibrate --cell FILE) and set camera.calibration to the result"
        )


def clear_height(cell: Cell, tallest: float, *, below: float | None = None) -> float:
    """Height of the TCP at which the hand passes over everything on the table, base frame, metres.

    Args:
        cell: The cell.
        tallest: Height of the tallest thing over the table, metres.
        below: Distance by which a part in the hand reaches below the TCP, metres; None: the pads do.
    """
    if below is None:
        below = cell.arm.limits.gripper.pad_reach
    return cell.workspace.table_z + max(APPROACH, tallest + below + OVER)


def above_grasp(cell: Cell, grasp: Grasp, *, tallest: float = 0.0) -> Pose:
    """Pre-grasp: from here the hand descends straight to a grasp, and here it returns.

    Args:
        cell: The cell.
        grasp: A single one, base frame.
        tallest: Height of the tallest thing over the table, metres: the hand comes from above it.
    """
    x, y, z = grasp.position
    height = max(clear_height(cell, tallest), z + 0.02)
    return replace(grasp, position=np.array([x, y, height])).T_base_tcp


def put_down(
    cell: Cell,
    grasp: Grasp,
    *,
    height: float = PUT_DOWN,
    opening: float | None = None,
    tallest: float = 0.0,
) -> None:
    """Lower a lifted part to where it was grasped, open the fingers and rise.

    Args:
        cell: The hand holds the part over the table.
        grasp: Grasp of the lifted part, base frame.
        height: Height of the release above the grasp, metres; a part that falls 2 mm may shift by 1 mm.
        opening: As in `let_go`; None: as far as the hand does.
        tallest: As in `let_go`.

    Raises:
        MotionAborted: The part met the table early, because it hangs lower in the hand than before; or the
            hand touched something as it released the part and rose.
    """
    lower(cell, grasp, height=height)
    stroke = cell.arm.limits.gripper.stroke
    let_go(cell, grasp, opening=stroke if opening is None else opening, tallest=tallest)


def lower(cell: Cell, grasp: Grasp, *, height: float = 0.0) -> None:
    """Lower a lifted part to where it was grasped, or ``height`` metres above.

    Raises:
        MotionAborted: The part met the table early, because it hangs lower in the hand than before.
    """
    cell.arm.move_to_pose(grasp.raised(height).T_base_tcp, speed=0.15)


def let_go(cell: Cell, place: Grasp, *, opening: float | None = None, tallest: float = 0.0) -> None:
    """Open the fingers and rise straight.

    Args:
        cell: The hand is at ``place`` and holds a part.
        place: Pose of the hand as a grasp, base frame; the hand may be a little higher.
        opening: Distance of the pads afterwards, metres, at least `LEAST_RELEASE` more than now; None:
            `RELEASE` more than now. The fingers had room on the way down to the grasp, but since then the
            part has moved between them: one inside a bore may push it as it opens all the way. A hand that
            opens less far opens as far as it does.
        tallest: Height of the tallest thing over the table, the part included, over which the hand rises, m.

    Raises:
        MotionAborted: The hand touched something.
        ValueError: The hand does not open so far.
    """
    stroke = cell.arm.limits.gripper.stroke
    if opening is not None and not 0 <= opening <= stroke + SAME_HAND:
        raise ValueError(f"opening {opening} m is outside 0 .. {stroke} m")
    state = cell.arm.state()
    now = state.gripper_width
    width = now + RELEASE if opening is None else max(opening, now + LEAST_RELEASE)
    if width < min(stroke, state.max_width):
        cell.arm.move_gripper(width)
    else:
        cell.arm.open_gripper()
    cell.arm.move_to_pose(above_grasp(cell, place, tallest=tallest), speed=0.25)


def go_home(cell: Cell, *, tallest: float = 0.0, take: Callable[[], bool] | None = None) -> None:
    """Open the fingers, retreat upward and move the arm out of the camera's sight.

    What the hand holds is not dropped: a person takes it, or the hand puts it down straight below, as high as
    it was grasped. What it has held since an earlier program, a person must take. An arm that was guided by
    hand to beside the box moves home without the retreat, and so does one that cannot rise and is above all
    else. Where no way leads straight down, a simulated part falls.

    Args:
        cell: Connected.
        tallest: Height of the tallest thing over the table, over which the hand rises first, metres.
        take: Has a person take what the hand holds, and returns whether there is one
            (`hal.operator.Operator.take`). Without it a simulated arm puts down, and a real one refuses.

    Raises:
        HandFull: The hand holds something that nobody took; nothing moved.
        OutOfWorkspace: The way up, or home, is refused, and the fingers are open; or the way down is, and a
            real hand still holds the part.
        MotionAborted: The hand touched something.
    """
    arm = cell.arm
    held = arm.in_hand()
    if held is not None:
        if held.T_base_tcp is None:
            if take is None or not take():
                raise HandFull(
                    "the hand has held something since an earlier program, which would fall from an unknown "
                    "height: hold it, run python -m hal.home, which opens the fingers, then start again"
                )
        elif take is None and not arm.may_drop:
            raise HandFull(
                "the hand holds something, which would fall: put it down (hal.put_down), or take it and open "
                "the fingers (arm.open_gripper), then go home"
            )
        elif arm.may_drop or take is None or not take():
            _put_down_below(cell, float(held.T_base_tcp.position[2]))
    arm.open_gripper()
    state = arm.state()
    if np.abs(state.joints - cell.workspace.home).max() < JOINT_TOLERANCE:
        return
    here, limits = state.T_base_tcp, arm.limits
    inside = (limits.box_lower <= here.position) & (here.position <= limits.box_upper)
    if inside[:2].all():  # an arm that was guided by hand out of the box may not rise there
        clear = clear_height(cell, tallest)
        above = min(max(clear, here.position[2] + RETREAT), float(limits.box_upper[2]))
        try:
            arm.move_to_pose(_moved_to_height(here, above), speed=0.25)
        except OutOfWorkspace:  # a joint is near its limit
            if here.position[2] < clear - POSITION_TOLERANCE:
                raise
    arm.move_to_joints(cell.workspace.home)


def _put_down_below(cell: Cell, grasped: float) -> None:
    """Lower the hand until what it holds stands as high as it was grasped, or on something else."""
    here, height = cell.arm.state().T_base_tcp, grasped + PUT_DOWN
    if here.position[2] <= height:
        return
    try:
        cell.arm.move_to_pose(_moved_to_height(here, height), speed=0.15)
    except Stopped:
        raise
    except OutOfWorkspace:
        if not cell.arm.may_drop:
            raise
    except MotionAborted:
        cell.arm.recover()  # it stands on what it met


def _moved_to_height(pose: Pose, z: float) -> Pose:
    return Pose(position=np.array([*pose.position[:2], z]), quat_wxyz=pose.quat_wxyz)


def capture_at_home(cell: Cell, timeout_s: float = 5.0) -> RgbdFrame:
    """Take a frame that a grasp may be planned on: the arm is out of the camera's sight.

    Args:
        cell: Connected.
        timeout_s: As in `Camera.capture`.

    Raises:
        ArmInView: The arm is not at home, or stands in the camera's sight there.
        CaptureFailed: As in `Camera.capture`.
    """
    joints = cell.arm.state().joints
    off = np.abs(joints - cell.workspace.home)
    if off.max() > AT_HOME:
        raise ArmInView(
            f"joint {int(off.argmax()) + 1} is {off.max():.2f} rad from home: the arm may be in the camera's "
            "view; move it home first (hal.go_home, or python -m mskgrasp.plan --go-home)"
        )
    frame = cell.camera.capture(timeout_s)
    if cell.arm.links is not None and (name := link_in_sight(cell.arm.links, joints, frame, cell.workspace)):
        raise ArmInView(
            f"at home the arm's {name} is in the camera's sight of the region: choose other joints for "
            "workspace.home"
        )
    return frame
