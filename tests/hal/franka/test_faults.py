"""Every fault that an arm can have: the documented error in time, nothing moves by itself, all goes on after.

The drivers are the real wheels over the real wire protocol; the faults are made on the robot's side.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from hal import Arm
from hal.errors import (
    CommunicationLost,
    MotionAborted,
    NeedsRecovery,
    NotConnected,
)
from hal.franka.driver import DriverName
from hal.franka.path import joint_path
from tests.hal.franka.robots import (
    TIMEOUT_S,
    FakeRobot,
    arm_at,
    fci5,
    linked,
    plain_path,
    robot_for,
    write_cell,
)


@contextmanager
def once_moving(robot: FakeRobot, action: Callable[[], object]) -> Iterator[None]:
    """Does something when the arm is on its way; what comes of it must come within seconds."""
    begin = robot.joints()

    def act() -> None:
        robot.wait_until_moved(begin)
        acted.append(time.monotonic())
        action()

    acted: list[float] = []
    thread = threading.Thread(target=act)
    thread.start()
    try:
        yield
    finally:
        thread.join()
    assert acted, "the arm never moved"
    # libfranka gives up a silent link after one or two seconds; what hangs takes over 100 s (patience_s).
    assert time.monotonic() - acted[0] < 60


def assert_at_rest(robot: FakeRobot) -> None:
    robot.wait(0.5)  # an arm brakes for a moment
    first = robot.joints()
    robot.wait(0.5)
    assert robot.joints() == pytest.approx(first, abs=1e-2)  # MuJoCo creeps; the motion makes ten times that


def slow(arm: Arm) -> None:
    """Half a turn of seconds, whatever a test before has left."""
    here = arm.state().joints
    arm.move_to_joints(np.array([-0.5 if here[0] > 0 else 0.5, *here[1:]]), speed=0.1)


def nudge(arm: Arm) -> None:
    """A short motion that shows that the arm moves again."""
    here = arm.state().joints
    arm.move_to_joints(here + np.array([-0.05 if here[0] > 0 else 0.05, *np.zeros(6)]), speed=1.0)


@pytest.fixture(scope="module", params=["franky", pytest.param("panda_py", marks=pytest.mark.slow)])
def driver(request: pytest.FixtureRequest) -> DriverName:
    return request.param


@pytest.fixture(scope="module")
def standing(driver: DriverName) -> Iterator[FakeRobot]:
    with robot_for(driver) as robot:
        yield robot


@pytest.fixture
def robot(standing: FakeRobot) -> FakeRobot:
    """On, without a fault and with empty hands; tests that end a robot start their own."""
    for order in ("user_release", "answer ok", "part 0"):
        standing.order(order)
    return standing


def test_a_reflex_ends_the_motion_and_nothing_moves_before_recover(
    driver: DriverName, robot: FakeRobot, tmp_path: Path
):
    with arm_at(tmp_path, driver, robot.host) as arm:
        with once_moving(robot, lambda: robot.order("reflex")), pytest.raises(MotionAborted, match="reflex"):
            slow(arm)
        assert_at_rest(robot)
        with pytest.raises(NeedsRecovery, match=r"recover\(\)"):
            nudge(arm)
        with pytest.raises(NeedsRecovery):
            arm.move_gripper(0.05)
        arm.recover()
        nudge(arm)


def test_a_reflex_between_motions_is_not_recovered_silently(
    driver: DriverName, robot: FakeRobot, tmp_path: Path
):
    with arm_at(tmp_path, driver, robot.host) as arm:
        robot.order("reflex")
        before = robot.joints()
        with pytest.raises(NeedsRecovery, match="mode reflex"):
            nudge(arm)
        assert robot.joints() == pytest.approx(before, abs=2e-3)
        arm.recover()
        nudge(arm)


def test_a_reflex_after_a_motion_of_this_program_is_a_result_as_one_in_a_motion(
    driver: DriverName, robot: FakeRobot, tmp_path: Path
):
    with arm_at(tmp_path, driver, robot.host) as arm:
        nudge(arm)
        robot.order("reflex")
        with pytest.raises(MotionAborted, match=r"reflex: .*recover\(\)"):
            arm.wait(0.1)
        with pytest.raises(NeedsRecovery):
            nudge(arm)
        arm.recover()
        nudge(arm)


def test_the_user_stop_is_reported_and_recover_waits_for_its_release(
    driver: DriverName, robot: FakeRobot, tmp_path: Path
):
    with arm_at(tmp_path, driver, robot.host) as arm:
        with (
            once_moving(robot, lambda: robot.order("user_stop")),
            pytest.raises(MotionAborted, match="preempted"),
        ):
            slow(arm)
        with pytest.raises(NeedsRecovery, match="user stop"):
            arm.recover()
        with pytest.raises(NeedsRecovery, match=r"recover\(\)"):
            nudge(arm)
        robot.order("user_release")
        arm.recover()
        nudge(arm)


def test_franky_cannot_connect_to_a_robot_that_is_not_idle_and_the_error_tells_what_to_do(tmp_path: Path):
    """It states thresholds of its own as it connects, which such a robot refuses."""
    with robot_for("franky") as robot:
        for fault in ("reflex", "user_stop"):
            robot.order(fault)
            with pytest.raises(NotConnected, match="not possible .* release the user stop .* start again"):
                arm_at(tmp_path, "franky", robot.host).connect()
            robot.order("user_release")
        with arm_at(tmp_path, "franky", robot.host) as arm:
            nudge(arm)


@pytest.mark.parametrize("fault", ["reflex", "user_stop"])
def test_a_robot_that_is_not_idle_gets_its_thresholds_from_panda_py_before_it_moves(
    tmp_path: Path, fault: str
):
    with fci5() as robot:
        robot.order(fault)
        begin = robot.joints()
        with linked("panda_py", robot.host) as link:
            path = joint_path(begin, begin + 0.1, speed=np.full(7, 0.5), acceleration=np.full(7, 3.0))
            with pytest.raises(MotionAborted, match="Set Collision Behavior .* release the user stop"):
                link.ask("move_joints", timeout_s=TIMEOUT_S, **plain_path(path))
        assert robot.joints() == pytest.approx(begin, abs=1e-3)
        with arm_at(tmp_path, "panda_py", robot.host, contact_force=18.0) as arm:
            assert robot.order("thresholds") == ""
            with pytest.raises(NeedsRecovery, match="mode (reflex|user_stopped).* start again"):
                nudge(arm)
            if fault == "user_stop":
                robot.order("user_release")
            arm.recover()
            nudge(arm)
            assert robot.order("thresholds") == "20.0 18.0"


def test_a_state_is_measured_after_it_was_asked_for(driver: DriverName, robot: FakeRobot, tmp_path: Path):
    """libfranka keeps a sample that nobody has read; the first to ask would get what was true before."""
    with arm_at(tmp_path, driver, robot.host) as arm:
        for _ in range(20):
            for order, mode in (("user_stop", "user_stopped"), ("user_release", "idle")):
                robot.order(order)
                assert arm._measure().mode == mode


@pytest.mark.slow
def test_a_cable_pulled_in_mid_motion_is_reported_within_seconds(
    driver: DriverName, robot: FakeRobot, tmp_path: Path
):
    with arm_at(tmp_path, driver, robot.host) as arm:
        with (
            once_moving(robot, robot.freeze),
            pytest.raises(CommunicationLost, match="open the cell again"),
        ):
            slow(arm)
        for command in (arm.state, arm.recover, lambda: slow(arm)):
            with pytest.raises(CommunicationLost):
                command()
    robot.process.send_signal(signal.SIGCONT)
    assert_at_rest(robot)
    with arm_at(tmp_path, driver, robot.host) as arm:
        arm.recover()
        nudge(arm)


@pytest.mark.slow
def test_a_robot_that_is_switched_off_in_mid_motion_is_reported(driver: DriverName, tmp_path: Path):
    with robot_for(driver) as robot, arm_at(tmp_path, driver, robot.host) as arm:
        with (
            once_moving(robot, robot.process.kill),
            pytest.raises(CommunicationLost, match="open the cell again"),
        ):
            slow(arm)
        with pytest.raises(NotConnected, match="no robot at"):
            arm_at(tmp_path, driver, robot.host).connect()
    with robot_for(driver, robot.host), arm_at(tmp_path, driver, robot.host) as arm:
        arm.state()


@pytest.mark.slow
def test_a_second_program_is_reported_and_the_first_goes_on(
    driver: DriverName, robot: FakeRobot, tmp_path: Path
):
    with arm_at(tmp_path, driver, robot.host) as arm:
        second = arm_at(tmp_path, driver, robot.host, connect_timeout_s=4.0)
        begin = time.monotonic()
        with pytest.raises(
            NotConnected, match="did not answer within 4 s: .* another program may hold the robot"
        ):
            second.connect()
        assert time.monotonic() - begin < 30
        nudge(arm)
        arm.close()
        with arm_at(tmp_path, driver, robot.host) as third:
            third.state()


def test_a_driver_process_that_dies_is_reported_and_the_arm_stops(
    driver: DriverName, robot: FakeRobot, tmp_path: Path
):
    with arm_at(tmp_path, driver, robot.host) as arm:
        link = arm._link
        assert link is not None
        with once_moving(robot, lambda: os.kill(link.pid, signal.SIGKILL)):
            with pytest.raises(CommunicationLost, match="ended by SIGKILL"):
                slow(arm)
        assert_at_rest(robot)
    with arm_at(tmp_path, driver, robot.host) as arm:
        nudge(arm)


@pytest.mark.parametrize("ending", [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.slow)])
def test_a_program_that_is_ended_in_mid_motion_leaves_an_arm_at_rest(
    driver: DriverName, robot: FakeRobot, tmp_path: Path, ending: signal.Signals
):
    """Ctrl-C and a killed process; the motion would take ten seconds more."""
    path = write_cell(tmp_path, driver, robot.host)
    code = (
        "import signal, sys, numpy as np\n"
        # A shell's background job ignores Ctrl-C, and so would all that it starts.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from hal import cell_from_yaml\n"
        "with cell_from_yaml(__import__('pathlib').Path(sys.argv[1])).arm as arm:\n"
        "    q = arm.state().joints\n"
        "    print('moving', flush=True)\n"
        "    arm.move_to_joints(np.array([-0.5 if q[0] > 0 else 0.5, *q[1:]]), speed=0.05)\n"
    )
    program = subprocess.Popen(
        [sys.executable, "-c", code, path], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert program.stdout is not None
    begin = robot.joints()
    assert program.stdout.readline().strip() == "moving"
    robot.wait_until_moved(begin, 0.01)
    program.send_signal(ending)
    _, error = program.communicate(timeout=TIMEOUT_S)
    assert program.returncode != 0
    if ending is signal.SIGINT:
        assert "KeyboardInterrupt" in error
    robot.wait(1.5)
    assert_at_rest(robot)
    assert np.abs(robot.joints() - begin).max() < 0.4  # it was going for 0.5 rad or more
    with arm_at(tmp_path, driver, robot.host) as arm:
        arm.move_gripper(0.05)


@pytest.mark.slow
@pytest.mark.parametrize("op", ["state", "stop"])
def test_a_driver_that_hangs_ends_after_its_program(
    driver: DriverName, robot: FakeRobot, tmp_path: Path, op: str
):
    """A robot that answers nothing any more, and a program that is killed before its request is overdue."""
    code = (
        "import sys, threading, time\n"
        "from hal import cell_from_yaml\n"
        "with cell_from_yaml(__import__('pathlib').Path(sys.argv[1])).arm as arm:\n"
        "    print(arm._link.pid, flush=True)\n"
        "    sys.stdin.readline()\n"
        "    process, sent = arm._link._process, threading.Event()\n"
        "    send = process._send\n"
        "    process._send = lambda *request: (send(*request), sent.set())\n"
        "    threading.Thread(target=lambda: arm._link.ask(sys.argv[2], timeout_s=5), daemon=True).start()\n"
        "    sent.wait()\n"
        "    print('asked', flush=True)\n"
        "    time.sleep(60)\n"
    )
    path = write_cell(tmp_path, driver, robot.host)
    with subprocess.Popen(
        [sys.executable, "-c", code, path, op], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as program:
        assert program.stdin is not None and program.stdout is not None
        driver_state = Path(f"/proc/{program.stdout.readline().strip()}/stat")
        robot.freeze()
        program.stdin.write("\n")
        program.stdin.flush()
        assert program.stdout.readline().strip() == "asked"
        program.kill()
    deadline = time.monotonic() + TIMEOUT_S
    while driver_state.exists() and driver_state.read_text().rpartition(")")[2].split()[0] != "Z":
        assert time.monotonic() < deadline, "the driver outlives its program"
        time.sleep(0.1)
    robot.process.send_signal(signal.SIGCONT)


@pytest.mark.slow
def test_a_grasp_that_misses_is_the_same_outcome_however_it_is_reported(
    driver: DriverName, robot: FakeRobot, tmp_path: Path
):
    with arm_at(tmp_path, driver, robot.host) as arm:
        for answer in ("ok", "unsuccessful", "fail", "aborted"):
            robot.order(f"answer {answer}")
            arm.move_gripper(0.03)
            outcome = arm.grasp(20.0)
            assert outcome.holding is False and outcome.width < 2e-3, answer
        arm.move_gripper(0.02)  # a miss is no fault


def test_a_part_between_the_pads_is_held_at_its_width(driver: DriverName, robot: FakeRobot, tmp_path: Path):
    with arm_at(tmp_path, driver, robot.host) as arm:
        arm.move_gripper(0.05)
        robot.order("part 0.03")
        outcome = arm.grasp(20.0)
        assert outcome.holding is True and outcome.width == pytest.approx(0.03, abs=4e-3)  # MuJoCo is soft
        robot.order("answer fail")  # there is a part, but the hand gave it up: not held
        arm.move_gripper(0.05)
        assert arm.grasp(20.0).holding is False


def test_leaving_the_context_in_mid_motion_stops_the_arm(tmp_path: Path):
    with fci5() as robot, arm_at(tmp_path, "panda_py", robot.host) as arm:
        with once_moving(robot, arm.close), pytest.raises((MotionAborted, CommunicationLost)):
            slow(arm)
        assert_at_rest(robot)
