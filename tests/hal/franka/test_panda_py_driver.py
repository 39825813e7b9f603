"""The driver on panda_py, in its process, against our server of the Panda's protocol."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

from hal.errors import MotionAborted
from hal.franka.driver import column_major
from hal.franka.frames import F_T_EE
from hal.franka.link import DriverLink
from hal.franka.path import JointPath, joint_path
from mskgrasp.core.panda_kinematics import forward
from tests.hal.franka.robots import TIMEOUT_S, FakeRobot, fci5, linked, plain_path


@pytest.fixture(scope="module")
def robot() -> Iterator[FakeRobot]:
    with fci5() as robot:
        yield robot


@pytest.fixture(scope="module")
def link(robot: FakeRobot) -> Iterator[DriverLink]:
    with linked("panda_py", robot.host) as link:
        yield link


def path_by(robot: FakeRobot, way: float, speed: float = 0.5) -> JointPath:
    here = robot.joints()
    goal = here + np.array([way, 0, 0, way / 2, 0, 0, -way])
    return joint_path(here, goal, speed=np.full(7, speed), acceleration=np.full(7, 3.0))


def test_a_state_is_the_robots_in_libfrankas_terms(robot: FakeRobot, link: DriverLink):
    before = time.monotonic()
    state = link.ask("state", timeout_s=TIMEOUT_S)
    assert before <= state["seconds"] <= time.monotonic()
    assert state["joints"] == pytest.approx(robot.joints(), abs=1e-6)
    assert state["o_t_ee"] == pytest.approx(column_major(forward(robot.joints())[0]), abs=1e-6)
    assert state["f_t_ee"] == pytest.approx(column_major(F_T_EE), abs=1e-9)
    assert (state["mode"], state["width"]) == ("idle", pytest.approx(0.06))


def test_an_arm_arrives_within_a_milliradian_although_its_controller_leaves_an_error(
    robot: FakeRobot, link: DriverLink
):
    path = path_by(robot, 0.1)
    link.ask("move_joints", timeout_s=TIMEOUT_S, **plain_path(path))
    assert np.abs(robot.joints() - path.joints[-1]).max() < 2e-3
    # After a motion panda_py would repeat its last sample: what follows must be seen.
    robot.order("user_stop")
    assert link.ask("state", timeout_s=TIMEOUT_S)["mode"] == "user_stopped"
    robot.order("user_release")
    assert link.ask("state", timeout_s=TIMEOUT_S)["mode"] == "idle"


def stop_on_the_way(robot: FakeRobot, link: DriverLink, path: JointPath) -> None:
    """Stops a motion as soon as the arm moves, which ends it by an error."""
    begin = robot.joints()
    stopper = threading.Thread(
        target=lambda: (robot.wait_until_moved(begin), link.ask("stop", timeout_s=TIMEOUT_S))
    )
    stopper.start()
    with pytest.raises(MotionAborted, match="preempted"):
        link.ask("move_joints", timeout_s=TIMEOUT_S, **plain_path(path))
    stopper.join()


def test_a_stop_ends_a_motion_and_is_in_force_until_recover(robot: FakeRobot, link: DriverLink):
    begin, path = robot.joints(), path_by(robot, -0.5, speed=0.1)
    stop_on_the_way(robot, link, path)
    stood = robot.joints()
    assert 0.02 <= np.abs(stood - begin).max() < 0.3
    with pytest.raises(MotionAborted, match="preempted"):
        link.ask("move_joints", timeout_s=TIMEOUT_S, **plain_path(path_by(robot, 0.1)))
    assert link.ask("move_gripper", timeout_s=TIMEOUT_S, width=0.02, speed=0.1) is False
    assert robot.joints() == pytest.approx(stood, abs=1e-3)
    assert link.ask("recover", timeout_s=TIMEOUT_S) is True
    assert link.ask("move_gripper", timeout_s=TIMEOUT_S, width=0.05, speed=0.1) is True


def test_the_hand_is_homed_grips_and_says_what_it_holds(robot: FakeRobot, link: DriverLink):
    assert link.ask("home_gripper", timeout_s=TIMEOUT_S) is True
    assert link.ask("state", timeout_s=TIMEOUT_S)["max_width"] == pytest.approx(0.0797)
    robot.order("part 0.03")
    assert link.ask("grasp", timeout_s=TIMEOUT_S, speed=0.1, force=20.0) is True
    assert link.ask("state", timeout_s=TIMEOUT_S)["width"] == pytest.approx(0.03, abs=1e-3)
    robot.order("part 0")


def test_a_reflex_is_recovered_from(robot: FakeRobot, link: DriverLink):
    robot.order("reflex")
    assert link.ask("state", timeout_s=TIMEOUT_S)["mode"] == "reflex"
    assert link.ask("recover", timeout_s=TIMEOUT_S) is True
    assert link.ask("state", timeout_s=TIMEOUT_S)["mode"] == "idle"


def test_a_reflex_of_a_stopped_motion_is_no_error_of_the_next(robot: FakeRobot, link: DriverLink):
    """panda_py keeps an error until it is asked, here one that came after the stop had ended the motion."""
    path = path_by(robot, 0.3, speed=0.1)
    robot.order("reflex_at_end")
    stop_on_the_way(robot, link, path)
    assert link.ask("state", timeout_s=TIMEOUT_S)["mode"] == "reflex"
    assert link.ask("recover", timeout_s=TIMEOUT_S) is True
    link.ask("move_joints", timeout_s=TIMEOUT_S, **plain_path(path_by(robot, -0.05)))
