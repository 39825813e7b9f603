"""Checks of the base class of arms, tested on an arm that reaches every target at once."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Iterator

import numpy as np
import pytest

from hal.errors import MotionAborted, NeedsRecovery, OutOfWorkspace
from mskgrasp.core.geometry import Pose
from tests.hal.replay.toy import DOWN, ToyArm

TIMEOUT_S = 60.0


@pytest.fixture
def arm() -> Iterator[ToyArm]:
    with ToyArm() as arm:
        yield arm


def at(x: float, y: float, z: float, quat_wxyz: np.ndarray = DOWN) -> Pose:
    return Pose(position=np.array([x, y, z]), quat_wxyz=quat_wxyz)


def joints_at(x: float, y: float, z: float) -> np.ndarray:
    return np.array([x, y, z, 0, 0, 0, 0])


def test_a_hand_that_would_tilt_into_the_table_on_its_way_is_refused(arm: ToyArm):
    """Both ends are 12 mm clear; between them the hand turns over a corner that reaches 45 mm lower."""
    tilted = np.array([[0.342, 0.817, 0.333, -0.322], [0.470, 0.342, -0.814, -0.014]])
    start, goal = (at(0.4, 0.0, 0.05, quat / np.linalg.norm(quat)) for quat in tilted)
    arm.move_to_pose(at(0.4, 0.0, 0.3, start.quat_wxyz))
    arm.move_to_pose(start)
    with pytest.raises(OutOfWorkspace, match="straight line to this pose brings the hand down to -0.03"):
        arm.move_to_pose(goal)
    assert arm.state().T_base_tcp.quat_wxyz == pytest.approx(start.quat_wxyz)
    arm.move_to_pose(at(0.4, 0.0, 0.3, start.quat_wxyz))
    arm.move_to_pose(at(0.4, 0.0, 0.3, goal.quat_wxyz))  # higher up there is room for it


def test_a_joint_motion_that_leaves_the_box_between_its_ends_is_refused(arm: ToyArm, monkeypatch):
    """Joint 1 turns the hand about the base, past a point in front of the box."""

    def about_the_base(joints: np.ndarray) -> Pose:
        return at(1.2 * np.cos(joints[0]), 1.2 * np.sin(joints[0]), 0.5)

    monkeypatch.setattr(arm, "_forward", about_the_base)
    arm._joints = joints_at(-0.9, 0.0, 0.5)
    with pytest.raises(OutOfWorkspace, match=r"passes \(1.200, .*move there in steps"):
        arm.move_to_joints(joints_at(0.9, 0.0, 0.5))
    assert arm.moves == 0


def test_joints_are_checked_without_a_connection_and_without_a_motion():
    arm = ToyArm()
    arm.check_joints(joints_at(0.4, 0.0, 0.5))
    for joints, message in [
        (joints_at(0.4, 1.2, 0.5), "joint 2 to 1.200 rad is outside"),
        (joints_at(0.4, 0.0, 0.005), "over the table"),
        (np.zeros(3), "joints must be 7 finite numbers"),
    ]:
        with pytest.raises(OutOfWorkspace, match=message):
            arm.check_joints(joints)
    arm.limits = dataclasses.replace(arm.limits, box_upper=np.array([0.3, 1.0, 1.0]))
    with pytest.raises(OutOfWorkspace, match="outside the workspace"):
        arm.check_joints(joints_at(0.4, 0.0, 0.5))
    assert arm.moves == 0


def test_an_arm_that_was_guided_out_of_its_box_may_come_back_but_go_no_farther(arm: ToyArm):
    arm.limits = dataclasses.replace(arm.limits, box_upper=np.array([1.0, 1.0, 0.7]))
    arm._joints = joints_at(0.4, 0.0, 0.8)
    with pytest.raises(OutOfWorkspace, match="outside the workspace"):
        arm.move_to_joints(joints_at(0.4, 0.0, 0.9))
    arm.move_to_joints(joints_at(0.4, 0.0, 0.6))
    assert arm.state().joints[2] == 0.6


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (at(0.4, 0.0, 0.3, np.array([0.0, 2.0, 0.0, 0.0])), "must have length 1"),
        (at(0.4, 0.0, 0.3, np.array([0.0, np.nan, 0.0, 0.0])), "finite"),
        (Pose(position=np.zeros((2, 3)), quat_wxyz=np.tile(DOWN, (2, 1))), "one pose"),
    ],
)
def test_what_is_no_pose_is_refused(arm: ToyArm, pose: Pose, message: str):
    with pytest.raises(OutOfWorkspace, match=message):
        arm.move_to_pose(pose)


@pytest.mark.parametrize("seconds", [-1.0, np.nan, np.inf])
def test_what_is_no_time_is_refused(arm: ToyArm, seconds: float):
    with pytest.raises(OutOfWorkspace, match="waiting time"):
        arm.wait(seconds)
    arm.move_gripper(0.05)  # a refusal is no fault


def test_pads_that_do_not_arrive_are_a_fault(arm: ToyArm, monkeypatch):
    monkeypatch.setattr(arm, "_move_gripper", lambda _: setattr(arm, "_width", 0.03))
    with pytest.raises(MotionAborted, match="pads stopped at 0.0300 m instead of 0.0100 m"):
        arm.move_gripper(0.01)
    with pytest.raises(NeedsRecovery):
        arm.move_gripper(0.03)


def test_a_stop_that_comes_while_the_arm_recovers_is_kept(arm: ToyArm, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(arm, "_recover", arm.stop)
        arm.recover()
    with pytest.raises(NeedsRecovery, match="stop"):
        arm.move_gripper(0.05)
    arm.recover()
    arm.move_gripper(0.05)


def test_a_recovery_that_fails_is_none(arm: ToyArm, monkeypatch):
    """Stopped between motions, so that there was no fault before."""

    def pressed() -> None:
        raise NeedsRecovery("the user stop is pressed")

    arm.stop()
    with monkeypatch.context() as patch:
        patch.setattr(arm, "_recover", pressed)
        with pytest.raises(NeedsRecovery, match="pressed"):
            arm.recover()
    with pytest.raises(NeedsRecovery, match="pressed"):
        arm.move_gripper(0.05)


def test_a_command_of_another_thread_waits_for_the_end_of_the_first(arm: ToyArm, monkeypatch):
    started, go_on, seen = threading.Event(), threading.Event(), []

    def slow(joints: np.ndarray, _: float) -> None:
        started.set()
        assert go_on.wait(TIMEOUT_S)
        arm._joints = joints.copy()

    monkeypatch.setattr(arm, "_move_to_joints", slow)
    monkeypatch.setattr(arm, "_move_gripper", lambda _: seen.append(arm._joints[0]))
    monkeypatch.setattr(arm, "_width", 0.05)
    first = threading.Thread(target=lambda: arm.move_to_joints(joints_at(0.5, 0.0, 0.5)))
    second = threading.Thread(target=lambda: arm.move_gripper(0.05))
    first.start()
    assert started.wait(TIMEOUT_S)
    second.start()
    second.join(0.1)
    assert second.is_alive() and not seen
    go_on.set()
    first.join()
    second.join()
    assert seen == [0.5]


def test_a_contact_is_no_fault_and_where_it_was_is_known(arm: ToyArm):
    arm.move_to_pose(at(0.4, 0.0, 0.1))
    contact = arm.move_until_contact(at(0.4, 0.0, -0.02))
    assert contact is not None and contact.position == pytest.approx([0.4, 0.0, 0.05])
    arm.move_to_pose(at(0.4, 0.0, 0.1))
    assert arm.move_until_contact(at(0.4, 0.0, 0.06)) is None


def test_a_refusal_of_the_second_leg_of_a_motion_is_a_fault_for_the_arm_has_moved(arm: ToyArm, monkeypatch):
    moved: list[Pose] = []

    def move(pose: Pose, speed: float) -> None:
        if len(moved) == n_moved:
            raise OutOfWorkspace("no straight line from here")
        moved.append(pose)

    monkeypatch.setattr(arm, "_legs", lambda pose: [at(0.4, 0.0, 0.4), pose])
    monkeypatch.setattr(arm, "_move_to_pose", move)
    n_moved = 0
    with pytest.raises(OutOfWorkspace):
        arm.move_to_pose(at(0.4, 0.0, 0.3))
    n_moved = 1
    with pytest.raises(MotionAborted, match="part of the way: no straight line"):
        arm.move_to_pose(at(0.4, 0.0, 0.3))
    with pytest.raises(NeedsRecovery):
        arm.move_gripper(0.05)


def test_a_search_that_ends_short_of_its_pose_without_a_contact_is_a_fault(arm: ToyArm, monkeypatch):
    arm.move_to_pose(at(0.4, 0.0, 0.1))
    monkeypatch.setattr(arm, "_move_until_contact", lambda *_: None)
    with pytest.raises(MotionAborted, match="40.0 mm"):
        arm.move_until_contact(at(0.4, 0.0, 0.06))
    with pytest.raises(NeedsRecovery):
        arm.move_gripper(0.05)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"force": 0.0}, "contact force 0 N"),
        ({"force": 16.0}, "outside 0 .. 15 N"),
        ({"speed": 0.06}, "outside 0 .. 0.05 m/s"),
    ],
)
def test_a_contact_is_sought_slowly_and_softly(arm: ToyArm, settings: dict[str, float], message: str):
    with pytest.raises(OutOfWorkspace, match=message):
        arm.move_until_contact(at(0.4, 0.0, 0.06), **settings)


def test_a_slowed_arm_moves_at_a_share_of_all_speeds(arm: ToyArm, monkeypatch):
    speeds: list[float] = []
    for name in ("_move_to_joints", "_move_to_pose", "_move_until_contact"):
        move = getattr(arm, name)

        def noted(*given, move=move):
            speeds.append(given[-1])
            return move(*given)

        monkeypatch.setattr(arm, name, noted)
    for pace in (0.1, 1.0):
        arm.slow_down(pace)
        arm.move_to_pose(at(0.4, 0.0, 0.3), speed=0.5)
        arm.move_until_contact(at(0.4, 0.0, 0.2), speed=0.02)
        arm.move_to_joints(arm.state().joints, speed=0.3)
    assert speeds == pytest.approx([0.05, 0.002, 0.03, 0.5, 0.02, 0.3])
    for pace in (0.0, 1.5):
        with pytest.raises(ValueError):
            arm.slow_down(pace)
