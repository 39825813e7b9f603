"""The driver on franky, in its process, against a simulated FR3."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

from hal.errors import CommunicationLost, MotionAborted
from hal.franka.config import JOINT_SPEED, FrankyArmConfig
from hal.franka.driver import column_major
from hal.franka.frames import F_T_EE
from hal.franka.link import DriverLink
from hal.franka.path import JointPath, joint_path, straight_path
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import PAD_REACH
from mskgrasp.core.panda_kinematics import forward
from tests.hal.franka.robots import TIMEOUT_S, FakeRobot, franky_sim, linked, plain_path

FR3 = FrankyArmConfig(driver="franky", host="x", robot="fr3")


@pytest.fixture(scope="module")
def robot() -> Iterator[FakeRobot]:
    with franky_sim() as robot:
        yield robot


@pytest.fixture(scope="module")
def link(robot: FakeRobot) -> Iterator[DriverLink]:
    with linked("franky", robot.host) as link:
        yield link


def path_by(link: DriverLink, way: list[float], speed: float = 0.5) -> JointPath:
    here = np.array(link.ask("state", timeout_s=TIMEOUT_S)["joints"])
    return joint_path(here, here + way, speed=np.full(7, speed), acceleration=np.full(7, 3.0))


def test_a_state_is_the_robots_in_libfrankas_terms(robot: FakeRobot, link: DriverLink):
    before = time.monotonic()
    state = link.ask("state", timeout_s=TIMEOUT_S)
    assert before <= state["seconds"] <= time.monotonic()
    assert state["joints"] == pytest.approx(robot.joints(), abs=2e-3)  # MuJoCo creeps
    # An FR3 has the Panda's Denavit-Hartenberg parameters.
    assert state["o_t_ee"] == pytest.approx(column_major(forward(np.array(state["joints"]))[0]), abs=1e-4)
    assert state["f_t_ee"] == pytest.approx(column_major(F_T_EE), abs=1e-6)
    assert state["mode"] == "idle"
    assert 0 <= state["width"] <= state["max_width"] == pytest.approx(0.08, abs=1e-3)


def test_a_joint_motion_ends_at_its_goal_in_its_time(robot: FakeRobot, link: DriverLink):
    """One joint all but stands."""
    path = path_by(link, [0.15, 1e-6, 0.0, 0.1, 0.0, -0.1, 0.2])
    begin = float(robot.order("clock"))
    link.ask("move_joints", timeout_s=TIMEOUT_S, **plain_path(path))
    assert float(robot.order("clock")) - begin >= 0.95 * path.duration_s - 0.01
    robot.wait(0.5)  # the simulated arm lags behind its commands
    assert robot.joints() == pytest.approx(path.joints[-1], abs=3e-3)


def test_a_stop_is_in_force_until_recover(robot: FakeRobot, link: DriverLink):
    path = path_by(link, [-0.1, 0, 0, 0, 0, 0, 0])
    before = robot.joints()
    link.ask("stop", timeout_s=TIMEOUT_S)
    with pytest.raises(MotionAborted, match="preempted"):
        link.ask("move_joints", timeout_s=TIMEOUT_S, **plain_path(path))
    assert link.ask("move_gripper", timeout_s=TIMEOUT_S, width=0.02, speed=0.1) is False
    assert robot.joints() == pytest.approx(before, abs=3e-3)
    assert link.ask("recover", timeout_s=TIMEOUT_S) is True
    assert link.ask("move_gripper", timeout_s=TIMEOUT_S, width=0.07, speed=0.1) is True
    assert link.ask("state", timeout_s=TIMEOUT_S)["width"] == pytest.approx(0.07, abs=2e-3)


def test_a_stop_that_the_robot_refuses_is_repeated_and_leaves_no_error_to_the_next_motion(
    robot: FakeRobot, link: DriverLink
):
    begin = robot.joints()
    path = path_by(link, [0.4 if begin[0] < 0 else -0.4, 0, 0, 0, 0, 0, 0], speed=0.1)
    robot.order("refuse_stops 3")

    def stop() -> None:
        robot.wait_until_moved(begin)
        with pytest.raises(MotionAborted, match="not possible in the current mode"):
            link.ask("stop", timeout_s=TIMEOUT_S)

    stopper = threading.Thread(target=stop)
    stopper.start()
    with pytest.raises(MotionAborted, match="preempted"):
        link.ask("move_joints", timeout_s=TIMEOUT_S, **plain_path(path))
    stopper.join()
    assert np.abs(robot.joints() - begin).max() < 0.3
    assert link.ask("recover", timeout_s=TIMEOUT_S) is True
    link.ask("move_joints", timeout_s=TIMEOUT_S, **plain_path(path_by(link, [0.05, 0, 0, 0, 0, 0, 0])))


def test_a_contact_ends_a_line_although_the_robot_refuses_to_stop_at_first(
    robot: FakeRobot, link: DriverLink
):
    joints = np.array(link.ask("state", timeout_s=TIMEOUT_S)["joints"])
    height = forward(joints)[0][2, 3]
    robot.order(f"table {height - PAD_REACH - 0.02} 0")
    robot.order("refuse_stops 2")
    goal, path = line(joints, [0.0, 0.0, -0.08], speed=0.02)
    met = link.ask(
        "move_straight", timeout_s=TIMEOUT_S, T_base_tcp=goal.tolist(), until_force=5.0, **plain_path(path)
    )
    robot.order("table -1 0")
    assert met is not None and height - 0.03 < met[14] < height - 0.015
    robot.wait(0.5)
    assert forward(robot.joints())[0][2, 3] > height - 0.06


def test_a_reflex_without_an_error_is_recovered_from(robot: FakeRobot, link: DriverLink):
    robot.order("reflex")
    assert link.ask("state", timeout_s=TIMEOUT_S)["mode"] == "reflex"
    assert link.ask("recover", timeout_s=TIMEOUT_S) is True
    assert link.ask("state", timeout_s=TIMEOUT_S)["mode"] == "idle"


@pytest.mark.slow
def test_a_driver_that_dies_on_a_line_leaves_poses_right_for_the_next():
    """The robot keeps the end effector's frame that the line had turned."""
    with franky_sim() as robot:
        with linked("franky", robot.host) as link:
            begin = np.array(link.ask("state", timeout_s=TIMEOUT_S)["joints"])
            killer = threading.Thread(
                target=lambda: (robot.wait_until_moved(begin), os.kill(link.pid, signal.SIGKILL))
            )
            killer.start()
            with pytest.raises(CommunicationLost):
                follow_line(link, begin, [-0.15, 0.2, -0.05])
            killer.join()
        robot.wait(1.0)
        with linked("franky", robot.host) as link:
            state = link.ask("state", timeout_s=TIMEOUT_S)
            assert state["f_t_ee"] == pytest.approx(column_major(F_T_EE), abs=1e-6)
            joints = np.array(state["joints"])
            assert state["o_t_ee"] == pytest.approx(column_major(forward(joints)[0]), abs=1e-4)
            goal = follow_line(link, joints, [0.05, -0.05, 0.0])
            robot.wait(1.0)
            reached = link.ask("state", timeout_s=TIMEOUT_S)["o_t_ee"]
            assert reached == pytest.approx(column_major(goal), abs=2e-3)


def follow_line(link: DriverLink, start: np.ndarray, way: list[float]) -> np.ndarray:
    """Moves the TCP straight by a way in the base; the pose there."""
    goal, path = line(start, way, speed=0.1)
    link.ask("move_straight", timeout_s=TIMEOUT_S, T_base_tcp=goal.tolist(), **plain_path(path))
    return goal


def line(start: np.ndarray, way: list[float], speed: float) -> tuple[np.ndarray, JointPath]:
    """Pose at the end of a straight way of the TCP in the base, and the path there."""
    goal = forward(start)[0]
    goal[:3, 3] += way
    path = straight_path(
        start, Pose.from_matrix(goal), speed=speed, turn_speed=1.0, acceleration=1.0, turn_acceleration=2.0,
        joint_speed=JOINT_SPEED, lower=FR3.joint_lower(), upper=FR3.joint_upper(),
    )  # fmt: skip
    return goal, path
