"""A Franka arm over the real wire protocol: what it does beyond the contract of all arms."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hal.arm import JOINT_TOLERANCE
from hal.errors import MotionAborted, NotConnected
from hal.franka.path import JointPath, joint_path
from mskgrasp.core.geometry import Pose
from tests.hal.franka.robots import arm_at, fci5, robot_for


def test_a_hand_that_was_never_homed_is_homed_by_the_first_command_and_not_by_connecting(tmp_path: Path):
    with fci5() as robot:
        robot.order("unhomed")
        with arm_at(tmp_path, "panda_py", robot.host) as arm:
            assert arm.state().gripper_width == pytest.approx(0.06)
            arm.move_gripper(0.05)
            arm.move_gripper(0.08)
            assert arm.state().gripper_width == pytest.approx(0.0797)  # all that homing found


def test_another_end_effector_in_desk_is_reported(tmp_path: Path):
    """Our server alone: franky-sim's hand cannot be taken off."""
    with fci5() as robot:
        robot.order("flange")
        with pytest.raises(NotConnected, match=r"end effector is at \(0.0000, .*choose it in Desk"):
            arm_at(tmp_path, "panda_py", robot.host).connect()


def test_pads_that_meet_something_on_their_way_are_reported(tmp_path: Path):
    """Our server alone: the fingers of franky-sim never come to rest when pressed against a stop."""
    with fci5() as robot, arm_at(tmp_path, "panda_py", robot.host) as arm:
        robot.order("part 0.03")
        with pytest.raises(MotionAborted, match="pads stopped at 0.0300 m instead of 0.0100 m"):
            arm.move_gripper(0.01)
        arm.recover()
        arm.move_gripper(0.05)


def test_the_config_bounds_the_speed_whatever_a_program_asks_for(tmp_path: Path):
    with fci5() as robot, arm_at(tmp_path, "panda_py", robot.host, max_speed=0.05) as arm:
        here = arm.state().T_base_tcp
        target = Pose(position=here.position - np.array([0, 0, 0.05]), quat_wxyz=here.quat_wxyz)
        begin = time.monotonic()
        arm.move_to_pose(target, speed=1.0)
        assert time.monotonic() - begin > 15 / 8 * 0.05 / 0.05 * 0.9


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
