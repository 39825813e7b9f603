"""Motions of a grasp on any cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hal.arm import JOINT_TOLERANCE
from hal.cell import Cell
from hal.errors import MotionAborted, Stopped
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import HOLD_S, MAX_OPENING, MIN_GAP, pose_base_tcp

APPROACH = 0.12
"""Height over the table from which the straight descent begins, m."""

RETREAT = 0.05
"""Height by which the open hand first rises on its way home, so that it does not drag the part along, m."""

PUT_DOWN = 0.002
"""A part is released this much above the height at which it was grasped, m."""

RELEASE = 0.02
"""Least opening of the fingers that releases a part, m."""


@dataclass(frozen=True, kw_only=True)
class GraspResult:
    """Outcome of a grasp as the arm measures it.

    Attributes:
        lifted: The fingers closed on something and the arm lifted it.
        holding: The fingers hold something after lift and hold.
        width: Distance of the pads then, metres.
        T_base_tcp: Measured TCP then.
        aborted: Reason if the motion ended early, else None; the arm then needs `recover`.
    """

    lifted: bool
    holding: bool
    width: float
    T_base_tcp: Pose
    aborted: str | None


def execute_grasp(cell: Cell, grasp: np.ndarray) -> GraspResult:
    """Opens, approaches, descends, closes, lifts and holds.

    Args:
        cell: Connected, without an error in force.
        grasp: (4,) x, y, z, theta, base frame.

    Raises:
        OutOfWorkspace: The grasp is refused before anything moves.
        HalError: The arm was lost or stopped; a motion that met resistance is a result, not an error.
    """
    arm, lift = cell.arm, cell.workspace.lift_height
    grasp = np.asarray(grasp, dtype=np.float64)
    target = pose_base_tcp(grasp)
    above = above_grasp(cell, grasp)
    lifted = grasp + np.array([0.0, 0.0, lift, 0.0])
    for pose in (target, above, pose_base_tcp(lifted)):
        arm.check_pose(pose)
    try:
        arm.move_gripper(MAX_OPENING)
        arm.move_to_pose(above, speed=0.4)
        arm.move_to_pose(target, speed=0.25)
        closed = arm.grasp(cell.workspace.grasp_force)
        if closed.holding:
            arm.move_to_pose(pose_base_tcp(lifted), speed=0.25)
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
        holding=closed.holding and state.gripper_width > MIN_GAP,
        width=state.gripper_width,
        T_base_tcp=state.T_base_tcp,
        aborted=None,
    )


def above_grasp(cell: Cell, grasp: np.ndarray) -> Pose:
    """Pre-grasp: from here the hand descends straight to a grasp (4,), and here it returns."""
    height = max(cell.workspace.table_z + APPROACH, grasp[2] + 0.02)
    return pose_base_tcp(np.array([grasp[0], grasp[1], height, grasp[3]]))


def put_down(
    cell: Cell, grasp: np.ndarray, *, height: float = PUT_DOWN, opening: float = MAX_OPENING
) -> None:
    """Lowers a lifted part to where it was grasped, opens the fingers and rises.

    Args:
        cell: The hand holds the part over the table.
        grasp: (4,) at which it was grasped.
        height: Of the release above the grasp, metres; falling 2 mm, a part may shift by 1 mm.
        opening: As in `let_go`.

    Raises:
        MotionAborted: The part met the table early, because it hangs lower in the hand than before; or the
            hand touched something as it released the part and rose.
    """
    lower(cell, grasp, height=height)
    let_go(cell, grasp, opening=opening)


def lower(cell: Cell, grasp: np.ndarray, *, height: float = 0.0) -> None:
    """Lowers a lifted part to where it was grasped, or ``height`` metres above.

    Raises:
        MotionAborted: The part met the table early, because it hangs lower in the hand than before.
    """
    place = np.asarray(grasp, dtype=np.float64) + np.array([0.0, 0.0, height, 0.0])
    cell.arm.move_to_pose(pose_base_tcp(place), speed=0.15)


def let_go(cell: Cell, place: np.ndarray, *, opening: float) -> None:
    """Opens the fingers and rises straight.

    Args:
        cell: The hand is at ``place`` and holds a part.
        place: (4,) x, y, z, theta, base frame; the hand may be a little higher.
        opening: Distance of the pads afterwards, metres; 0 for the least that releases the part, which is
            `RELEASE` more than now. The fingers had room on the way down to the grasp, but since then the
            part has moved between them: one inside a bore may push it as it opens all the way.

    Raises:
        MotionAborted: The hand touched something.
        ValueError: The hand does not open so far.
    """
    if not 0 <= opening <= MAX_OPENING:
        raise ValueError(f"opening {opening} m is outside 0 .. {MAX_OPENING} m")
    width = max(opening, cell.arm.state().gripper_width + RELEASE)
    cell.arm.move_gripper(min(MAX_OPENING, width))
    cell.arm.move_to_pose(above_grasp(cell, place), speed=0.25)


def go_home(cell: Cell) -> None:
    """Opens the fingers, retreats upward and moves the arm out of the camera's sight."""
    arm = cell.arm
    arm.move_gripper(MAX_OPENING)
    state = arm.state()
    if np.abs(state.joints - cell.workspace.home).max() < JOINT_TOLERANCE:
        return
    here = state.T_base_tcp
    above = max(cell.workspace.table_z + APPROACH, here.position[2] + RETREAT)
    above = min(above, float(arm.limits.box_upper[2]))
    arm.move_to_pose(
        Pose(position=np.array([*here.position[:2], above]), quat_wxyz=here.quat_wxyz), speed=0.25
    )
    arm.move_to_joints(cell.workspace.home)
