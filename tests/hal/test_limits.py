"""Limits of commands: boxes, tables and joints that can be worked out on paper."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hal.errors import OutOfWorkspace
from hal.limits import (
    ArmLimits,
    check_joint_path,
    check_line,
    check_target_joints,
    check_target_pose,
    lowest_point,
    shown,
    touching,
)
from mskgrasp.core.geometry import Pose
from mskgrasp.core.panda_kinematics import JOINT_LOWER, JOINT_UPPER, forward_pose

LIMITS = ArmLimits(
    joint_lower=np.array(JOINT_LOWER),
    joint_upper=np.array(JOINT_UPPER),
    box_lower=np.array([0.2, -0.4, 0.1]),
    box_upper=np.array([0.7, 0.4, 0.6]),
    table_z=0.1,
    max_force=70.0,
)
READY = np.array([0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398])


def hand(x: float, y: float, z: float, *, tilt: float = 0.0, axis: str = "x") -> Pose:
    """Pointing straight down, then tilted about an axis of the base by an angle in degrees."""
    turn = Rotation.from_euler(axis, tilt, degrees=True) * Rotation.from_euler("x", np.pi)
    return Pose(position=np.array([x, y, z]), quat_wxyz=turn.as_quat(scalar_first=True))


@pytest.mark.parametrize(
    ("pose", "height"),
    [
        (hand(0.5, 0.0, 0.3), 0.3 - 0.0095),  # the pads' tips
        (hand(0.5, 0.0, 0.3, tilt=180), 0.3 - 0.0375),  # upside down: the palm's underside
        # On its side: the palm's ends are 102 mm from the axis, its flanks 32 mm.
        (hand(0.5, 0.0, 0.3, tilt=90), 0.3 - 0.102),
        (hand(0.5, 0.0, 0.3, tilt=90, axis="y"), 0.3 - 0.032),
        # By 30 degrees about x the outer corner of a pad sinks by 56 mm sin 30.
        (hand(0.5, 0.0, 0.3, tilt=30), 0.3 - 0.056 * 0.5 - 0.0095 * np.cos(np.pi / 6)),
    ],
)
def test_the_lowest_corner_of_the_hand_is_found(pose: Pose, height: float):
    assert lowest_point(pose) == pytest.approx(height, abs=1e-9)


def test_the_hand_keeps_its_clearance_from_a_sloping_table():
    """The table rises by 1 % along x through z = 0.1 at x = 0.5; a pad is 11 mm wide on each side."""
    limits = replace(
        LIMITS, clearance=0.003, table_slope=np.array([0.01, 0.0]), table_centre=np.array([0.5, 0.0])
    )
    for x in (0.4, 0.5, 0.6):
        lowest = 0.1 + 0.01 * (x - 0.5 + 0.011) + 0.0095 + 0.003
        check_target_pose(limits, hand(x, 0.1, lowest + 1e-5))
        with pytest.raises(OutOfWorkspace, match=r"3.0 mm over the table|2.9 mm over the table"):
            check_target_pose(limits, hand(x, 0.1, lowest - 1e-5))


def test_a_motion_towards_a_contact_may_go_5_cm_under_the_table():
    limits = touching(replace(LIMITS, clearance=0.003))
    check_target_pose(limits, hand(0.5, 0.0, 0.05 + 0.0095 + 1e-5))
    with pytest.raises(OutOfWorkspace):
        check_target_pose(limits, hand(0.5, 0.0, 0.05 + 0.0095 - 1e-5))
    with pytest.raises(OutOfWorkspace, match="outside the workspace"):
        check_target_pose(limits, hand(0.8, 0.0, 0.2))


def test_joints_at_their_limits_are_accepted_and_beyond_them_named():
    check_target_joints(LIMITS, LIMITS.joint_lower)
    check_target_joints(LIMITS, LIMITS.joint_upper)
    over = READY.copy()
    over[3], over[5] = -0.05, 4.0
    with pytest.raises(OutOfWorkspace, match=r"^joint 4 to -0.050 rad is outside -3.072 .. -0.070 rad$"):
        check_target_joints(LIMITS, over)
    for wrong in (READY[:6], np.array([*READY[:6], np.inf]), READY[None]):
        with pytest.raises(OutOfWorkspace, match="7 finite numbers"):
            check_target_joints(LIMITS, wrong)


def test_a_target_is_refused_at_the_first_tenth_of_a_millimetre_too_low():
    """The pads reach 9.5 mm below the TCP and stay 1 mm above the table at 0.1 m."""
    check_target_pose(LIMITS, hand(0.5, 0.0, 0.1105))
    with pytest.raises(OutOfWorkspace, match=r"0.9 mm over the table; it must stay 1 mm .*z >= 0.1105 m"):
        check_target_pose(LIMITS, hand(0.5, 0.0, 0.1104))
    with pytest.raises(OutOfWorkspace, match="over the table"):
        check_target_pose(LIMITS, hand(0.5, 0.0, 0.13, tilt=30))


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", ["box_lower", "box_upper"])
def test_each_face_of_the_box_is_a_limit(axis: int, side: str):
    roomy = replace(LIMITS, table_z=-1.0)
    position = np.array([0.5, 0.0, 0.3])
    position[axis] = getattr(LIMITS, side)[axis]
    check_target_pose(roomy, hand(*position))
    position[axis] += 1e-3 if side == "box_upper" else -1e-3
    with pytest.raises(OutOfWorkspace, match=r"TCP target \(.*\) m is outside the workspace") as caught:
        check_target_pose(roomy, hand(*position))
    assert shown(position) in str(caught.value) and "\n" not in str(caught.value)


def test_a_line_between_two_legal_level_poses_is_always_legal():
    """The box is convex, and a level hand's height is that of its line."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        start, goal = (
            hand(*rng.uniform([0.2, -0.4, 0.1105], [0.7, 0.4, 0.6]), tilt=rng.uniform(-180, 180), axis="z")
            for _ in range(2)
        )
        check_line(LIMITS, start, goal)


def test_a_line_that_dips_between_tilted_ends_is_refused():
    """Tilting from side to side through level lowers nothing; half a turn of a hand on edge does."""
    level = (hand(0.5, 0.0, 0.25, tilt=50, axis="y"), hand(0.5, 0.0, 0.25, tilt=-50, axis="y"))
    check_line(LIMITS, *level)
    # Halfway the long side of the palm hangs down.
    start = Rotation.from_euler("y", 90, degrees=True) * Rotation.from_euler("x", np.pi)
    goal = start * Rotation.from_euler("z", 170, degrees=True)
    poses = [
        Pose(position=np.array([0.5, 0.0, 0.16]), quat_wxyz=turn.as_quat(scalar_first=True))
        for turn in (start, goal)
    ]
    for pose in poses:
        check_target_pose(LIMITS, pose)
    with pytest.raises(OutOfWorkspace, match="straight line to this pose brings the hand down to 0.05"):
        check_line(LIMITS, *poses)


def test_a_joint_motion_is_checked_where_it_ends_and_on_its_way():
    narrow = replace(LIMITS, box_upper=np.array([0.7, 0.29, 0.6]))
    check_joint_path(narrow, forward_pose, READY, READY + np.array([0.5, 0, 0, 0, 0, 0, 0]))
    # The hand is 0.307 m from the base's axis: a turn of 80 degrees brings it to y = 0.302 m.
    with pytest.raises(OutOfWorkspace, match=r"these joints put the TCP at \(0.053, 0.302, 0.487\) m"):
        check_joint_path(narrow, forward_pose, READY, READY + np.array([np.radians(80), 0, 0, 0, 0, 0, 0]))
    wide = replace(narrow, box_lower=np.array([-0.4, -0.4, 0.1]))
    start, goal = (READY + np.array([np.radians(turn), 0, 0, 0, 0, 0, 0]) for turn in (60, 120))
    with pytest.raises(OutOfWorkspace, match=r"way to these joints passes .*0.307.*; move there in steps"):
        check_joint_path(wide, forward_pose, start, goal)


def test_an_arm_that_stands_too_low_may_rise_but_not_sink():
    """Guided by hand to where the pads are 4 mm inside the clearance."""
    low = hand(0.5, 0.0, 0.1065)
    check_line(LIMITS, low, hand(0.5, 0.0, 0.2))
    with pytest.raises(OutOfWorkspace, match="brings the hand down to 0.094 m; the table is at 0.1 m"):
        check_line(LIMITS, low, hand(0.5, 0.1, 0.1035))
