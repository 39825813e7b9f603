"""A Franka arm over the real wire protocol: what it does beyond the contract of all arms."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hal import Load
from hal.arm import JOINT_TOLERANCE
from hal.config import READY
from hal.errors import LoadTooHeavy, MotionAborted, NeedsRecovery, NotConnected, OutOfWorkspace
from hal.franka.driver import DriverName
from hal.franka.path import JointPath, joint_path
from mskgrasp.core.geometry import Pose
from tests.hal.franka.robots import FakeRobot, arm_at, fci5, robot_for


@pytest.fixture(scope="module")
def panda() -> Iterator[FakeRobot]:
    """A robot that panda_py drives, for tests that leave it on, with its hand homed, and without a fault."""
    with fci5() as robot:
        yield robot


@pytest.mark.slow
def test_a_hand_that_was_never_homed_is_homed_by_the_first_command_and_not_by_connecting(tmp_path: Path):
    with fci5() as robot:
        robot.order("unhomed")
        with arm_at(tmp_path, "panda_py", robot.host) as arm:
            assert arm.state().gripper_width == pytest.approx(0.06)
            assert arm.state().max_width == 0.08  # not known yet
            arm.move_gripper(0.05)
            arm.move_gripper(0.08)
            assert arm.state().gripper_width == pytest.approx(0.0797)  # all that homing found
            assert arm.state().max_width == pytest.approx(0.0797)


@pytest.mark.slow
def test_fingers_that_open_less_far_are_opened_as_far_as_they_go(tmp_path: Path):
    """Changed fingers: until the hand is homed it believes in those before."""
    with fci5() as robot, arm_at(tmp_path, "panda_py", robot.host) as arm:
        robot.order("fingers 0.062")
        assert arm.state().max_width == pytest.approx(0.08)
        arm.home()
        assert arm.state().max_width == pytest.approx(0.062)
        arm.move_gripper(0.01)
        arm.open_gripper()
        assert arm.state().gripper_width == pytest.approx(0.062, abs=1e-4)
        with pytest.raises(OutOfWorkspace, match=r"outside 0 .. 0.0620 m, .*python -m hal.home"):
            arm.move_gripper(0.08)
        arm.move_gripper(0.06)  # a refusal is no fault


LOAD = Load(mass=0.4, centre_tcp=np.array([0.01, 0.02, 0.03]), inertia=np.diag([1e-4, 2e-4, 3e-4]))


@pytest.mark.parametrize("driver", ["franky", pytest.param("panda_py", marks=pytest.mark.slow)])
def test_a_robot_knows_the_part_in_its_hand_until_the_fingers_move(tmp_path: Path, driver: DriverName):
    with robot_for(driver) as robot:
        with arm_at(tmp_path, driver, robot.host) as arm:
            arm.open_gripper()
            arm.set_load(LOAD)
            # The flange is turned by 45 degrees from the tcp frame, 103.4 mm behind it.
            told, half = robot.load(), np.sqrt(0.5)
            assert told[:4] == pytest.approx([0.4, half * 0.03, half * 0.01, 0.1334], abs=1e-6)
            inertia = told[4:].reshape(3, 3)
            assert np.diag(inertia) == pytest.approx([1.5e-4, 1.5e-4, 3e-4], rel=1e-4)
            assert inertia[0, 1] == inertia[1, 0] == pytest.approx(5e-5, rel=1e-4)
            hand = arm.hand()
            assert hand is not None and hand.load_mass == pytest.approx(0.4)
            assert (hand.mass, hand.centre_flange) == (pytest.approx(0.73), pytest.approx([-0.01, 0, 0.03]))
            arm.move_gripper(0.05)
            assert robot.load() == pytest.approx(np.zeros(13))
            arm.set_load(LOAD)
        with arm_at(tmp_path, driver, robot.host) as arm:  # of a program before, whose part is unknown
            assert robot.load()[0] == pytest.approx(0.4)
            arm.open_gripper()
            assert robot.load() == pytest.approx(np.zeros(13))


def test_a_motion_that_the_solver_gives_up_is_planned_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A motion of days is what makes it give up every time."""
    impossible = [2, 3]

    def path_from(*args: Any, **settings: Any) -> JointPath:
        path = joint_path(*args, **settings)
        if impossible[0] == 0:
            return path
        impossible[0] -= 1
        return replace(path, seconds=1e6 * path.seconds)

    monkeypatch.setattr("hal.franka.arm.joint_path", path_from)
    with robot_for("franky") as robot, arm_at(tmp_path, "franky", robot.host) as arm:
        goal = arm.state().joints + np.array([0.1, 0.0, 0.0, 0.1, 0.0, 0.0, 0.1])
        arm.move_to_joints(goal, speed=0.5)
        stood = arm.state().joints
        assert impossible[0] == 0 and stood == pytest.approx(goal, abs=JOINT_TOLERANCE)
        impossible[:] = impossible[1:]
        with pytest.raises(MotionAborted, match="planner failed with error code"):
            arm.move_to_joints(goal - 0.1, speed=0.5)
        assert impossible[0] == 0 and arm.state().joints == pytest.approx(stood, abs=JOINT_TOLERANCE)


def test_a_part_over_what_the_reflex_holds_is_refused(tmp_path: Path, panda: FakeRobot):
    """15 N and 15 N m, four fifths of which may be weight."""
    with arm_at(tmp_path, "panda_py", panda.host, contact_force=15.0, contact_torque=15.0) as arm:
        assert arm.limits.max_load == pytest.approx(0.8 * 15 / 9.81)
        before = panda.load()
        with pytest.raises(LoadTooHeavy, match=r"weighs 1.300 kg, this arm carries 1.223 kg: .*force"):
            arm.set_load(replace(LOAD, mass=1.3))
        assert panda.load() == pytest.approx(before)
        arm.set_load(replace(LOAD, mass=1.2))  # a refusal is no fault
        assert panda.load()[0] == pytest.approx(1.2)


def test_a_load_that_the_robot_refuses_is_a_fault(tmp_path: Path, panda: FakeRobot):
    with arm_at(tmp_path, "panda_py", panda.host) as arm:
        panda.order("reflex")
        with pytest.raises(MotionAborted, match="recover"):
            arm.set_load(LOAD)
        with pytest.raises(NeedsRecovery):
            arm.move_gripper(0.05)
        arm.recover()
        arm.set_load(LOAD)
        assert panda.load()[0] == pytest.approx(0.4)


@pytest.mark.slow
@pytest.mark.parametrize("driver", ["franky", pytest.param("panda_py", marks=pytest.mark.slow)])
def test_a_part_that_slips_away_after_closing_is_not_held(tmp_path: Path, driver: DriverName):
    """The hand goes on to report its grasp; the fingers close."""
    with robot_for(driver) as robot, arm_at(tmp_path, driver, robot.host) as arm:
        arm.open_gripper()
        robot.order("part 0.03")
        assert arm.grasp(20.0).holding
        assert arm.holds(arm.state()) and arm.state().grasped is True
        robot.order("part 0")
        robot.wait(2.0)
        state = arm.state()
        assert state.gripper_width < 1e-3 and not arm.holds(state)


def test_a_touch_that_the_reflex_would_end_is_refused_and_is_no_fault(tmp_path: Path, panda: FakeRobot):
    with arm_at(tmp_path, "panda_py", panda.host, contact_force=8.0) as arm:
        here = arm.state().T_base_tcp
        with pytest.raises(OutOfWorkspace, match=r"10 N is not under arm.contact_force 8 N"):
            arm.move_until_contact(here, force=10.0)
        assert arm.move_until_contact(here, force=5.0) is None


@pytest.mark.slow
def test_another_end_effector_in_desk_is_reported(tmp_path: Path):
    """Our server alone: franky-sim's hand cannot be taken off."""
    with fci5() as robot:
        robot.order("flange")
        with pytest.raises(NotConnected, match=r"end effector is at \(0.0000, .*choose it in Desk"):
            arm_at(tmp_path, "panda_py", robot.host).connect()


@pytest.mark.slow
def test_pads_that_meet_something_on_their_way_are_reported(tmp_path: Path):
    """Our server alone: the fingers of franky-sim never come to rest when pressed against a stop."""
    with fci5() as robot, arm_at(tmp_path, "panda_py", robot.host) as arm:
        robot.order("part 0.03")
        with pytest.raises(MotionAborted, match="pads stopped at 0.0300 m instead of 0.0100 m"):
            arm.move_gripper(0.01)
        arm.recover()
        arm.move_gripper(0.05)


def test_the_config_bounds_the_speed_whatever_a_program_asks_for(tmp_path: Path, panda: FakeRobot):
    with arm_at(tmp_path, "panda_py", panda.host, max_speed=0.05) as arm:
        here = arm.state().T_base_tcp
        target = Pose(position=here.position - np.array([0, 0, 0.05]), quat_wxyz=here.quat_wxyz)
        begin = time.monotonic()
        arm.move_to_pose(target, speed=1.0)
        assert time.monotonic() - begin > 15 / 8 * 0.05 / 0.05 * 0.9


def test_a_slowed_arm_keeps_a_share_of_the_speeds_of_its_file(tmp_path: Path, monkeypatch):
    """By the paths that the driver would get; a request may be faster or slower than the file."""
    arm = arm_at(tmp_path, "panda_py", "127.0.0.250", max_speed=0.2, max_joint_speed=0.2)
    here, paths = np.array(READY), []
    monkeypatch.setattr(arm, "_ready", lambda: SimpleNamespace(joints=here))
    monkeypatch.setattr(arm, "_follow", lambda path, *_: paths.append(path))
    start = arm._forward(here)
    down = Pose(position=start.position - np.array([0, 0, 0.2]), quat_wxyz=start.quat_wxyz)

    def fastest(pace: float, asked: float) -> tuple[float, float]:
        paths.clear()
        arm.slow_down(pace)
        arm._move_to_joints(here + 0.5, pace * asked)
        arm._move_to_pose(down, pace * asked)
        joints, line = (path.curve().derivative()(np.linspace(0, path.duration_s, 2000)) for path in paths)
        return float(np.abs(joints).max()), float(np.abs(line).max())

    for asked in (0.05, 1.0):
        assert fastest(0.1, asked) == pytest.approx(np.multiply(0.1, fastest(1.0, asked)), rel=0.02)


def test_an_arm_that_is_opened_again_asks_the_hand_what_it_holds(tmp_path: Path):
    with fci5() as robot:
        arm = arm_at(tmp_path, "panda_py", robot.host)
        with arm:
            arm.open_gripper()
            assert arm.in_hand() is None
        robot.order("part 0.03")
        with arm_at(tmp_path, "panda_py", robot.host) as other:
            assert other.grasp(20.0).holding
        with arm:
            held = arm.in_hand()
            assert held is not None and held.T_base_tcp is None
