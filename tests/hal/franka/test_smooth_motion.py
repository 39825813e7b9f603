"""What the drivers command on a motion, millisecond by millisecond: as smooth as planned, and straight."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from franky_sim.constants import DEFAULT_INITIAL_JOINT_POS
from scipy.spatial.transform import Rotation

from hal.franka import FrankyArmConfig
from hal.franka.arm import TURN_SPEED
from hal.franka.config import JOINT_SPEED
from hal.franka.link import DriverLink
from hal.franka.path import JointPath, joint_path, straight_path
from mskgrasp.core.geometry import Pose
from mskgrasp.core.panda_kinematics import forward, forward_pose, track
from tests.hal.franka.robots import TIMEOUT_S, FakeRobot, arm_at, fci5, franky_sim, linked, plain_path

GREATEST_RATIO = 1.5
"""Commanded over planned acceleration; chained waypoints made it 4 to 14."""
STRAIGHT_M = 0.3e-3
TICK_S = 1e-3
NOISE, NOISE_SHARE = 0.02, 0.05
"""Acceleration that is nothing, rad/s^2, and as a share of that of the joint with the greatest."""
ARM = FrankyArmConfig(driver="franky", host="x", robot="fr3")
# Shift in the base, m, turn of the hand, rad, and speed, m/s.
LINES = [
    pytest.param((0.0, 0.0, -0.05), 0.0, 0.05, id="descent at 0.05 m/s"),
    pytest.param((0.0, 0.0, 0.11), 0.0, 0.1, id="lift at 0.1 m/s"),
    pytest.param((0.06, 0.08, 0.0), 0.4, 0.1, id="across with a turn at 0.1 m/s"),
    pytest.param((0.0, 0.0, -0.11), 0.0, 0.25, id="descent at 0.25 m/s"),
    pytest.param((-0.1, -0.16, 0.05), 0.0, 0.25, id="aslant at 0.25 m/s"),
]
MOSTLY_SLOW = [
    *(pytest.param(*line.values, id=line.id, marks=pytest.mark.slow) for line in LINES[:-1]),
    LINES[-1],
]


@pytest.fixture(scope="module")
def robot() -> Iterator[FakeRobot]:
    with franky_sim() as robot:
        yield robot


@pytest.fixture(scope="module")
def link(robot: FakeRobot) -> Iterator[DriverLink]:
    with linked("franky", robot.host) as link:
        yield link


def line_from(
    joints: np.ndarray, shift: tuple[float, float, float], turn: float, speed: float
) -> tuple[JointPath, Pose]:
    matrix = forward_pose(joints).as_matrix()
    matrix[:3, 3] += shift
    matrix[:3, :3] = matrix[:3, :3] @ Rotation.from_euler("z", turn).as_matrix()
    goal = Pose.from_matrix(matrix)
    path = straight_path(
        joints, goal, speed=speed, turn_speed=1.0, acceleration=1.0, turn_acceleration=2.0,
        joint_speed=JOINT_SPEED, lower=ARM.joint_lower(), upper=ARM.joint_upper(),
    )  # fmt: skip
    return path, goal


def recorded(robot: FakeRobot, folder: Path) -> dict[str, np.ndarray]:
    """Commands since `record`, one each tick."""
    robot.order(f"save {folder / 'commands.npz'}")
    with np.load(folder / "commands.npz") as file:
        commands = dict(file)
    assert (np.diff(commands["ticks"].astype(int)) == 1).all()
    return commands


def acceleration(values: np.ndarray, every: int = 1) -> np.ndarray:
    """(k, n) of values (k, n) each tick, by differences over ``every`` ticks."""
    return np.diff(values[::every], 2, axis=0) / (every * TICK_S) ** 2


def allowed_acceleration(path: JointPath) -> np.ndarray:
    """(7,) for the joints, rad/s^2."""
    planned = np.abs(path.curve()(np.arange(0, path.duration_s, TICK_S), 2)).max(axis=0)
    return GREATEST_RATIO * planned + np.maximum(NOISE, NOISE_SHARE * planned.max())


def off_line(points: np.ndarray, begin: np.ndarray, end: np.ndarray) -> float:
    """Greatest distance of points (k, 3) from a line, m."""
    way = (end - begin) / np.linalg.norm(end - begin)
    return float(np.linalg.norm(np.cross(points - begin, way), axis=1).max())


@pytest.mark.parametrize(("shift", "turn", "speed"), MOSTLY_SLOW)
def test_franky_commands_a_straight_line_as_smooth_as_planned(
    robot: FakeRobot, link: DriverLink, tmp_path: Path, shift, turn: float, speed: float
):
    start = np.array(link.ask("state", timeout_s=TIMEOUT_S)["joints"])
    path, goal = line_from(start, shift, turn, speed)
    robot.order("record")
    link.ask("move_straight", timeout_s=TIMEOUT_S, T_base_tcp=goal.as_matrix().tolist(), **plain_path(path))
    commands = recorded(robot, tmp_path)
    assert len(commands["ticks"]) * TICK_S == pytest.approx(path.duration_s, rel=0.1)
    # The frame may be turned: its origin is the TCP all the same.
    points = commands["poses"][:, :3, 3]
    assert points[-1] == pytest.approx(goal.position, abs=1e-6)
    assert points[0] == pytest.approx(forward_pose(start).position, abs=2e-3)
    assert off_line(points, points[0], goal.position) < STRAIGHT_M
    times = np.arange(0, path.duration_s, TICK_S)
    planned = acceleration(forward(path.curve()(times))[0][:, :3, 3], 4)
    # franky rounds poses to 1e-8 m, which differences over a tick make 0.02 m/s^2.
    assert np.abs(acceleration(points, 4)).max() < GREATEST_RATIO * np.abs(planned).max()
    poses = commands["poses"]
    poses[:, :3, :3] = poses[:, :3, :3] @ poses[-1, :3, :3].T @ goal.as_matrix()[:3, :3]
    joints = np.repeat(track(poses[::10], start)[0], 10, axis=0)
    assert (np.abs(acceleration(joints, 10)) < allowed_acceleration(path)).all()
    robot.wait(0.5)  # the simulated arm lags behind its commands
    state = link.ask("state", timeout_s=TIMEOUT_S)
    assert state["o_t_ee"][12:15] == pytest.approx(goal.position, abs=1e-3)
    assert state["f_t_ee"][14] == pytest.approx(0.1034)


@pytest.mark.parametrize("share", [0.1, 0.4])
def test_franky_commands_a_joint_motion_as_smooth_as_planned(
    robot: FakeRobot, link: DriverLink, tmp_path: Path, share: float
):
    start = np.array(link.ask("state", timeout_s=TIMEOUT_S)["joints"])
    way = np.array([0.1, -0.05, 0.02, 0.15, 1e-6, -0.1, 0.2]) * (1 if share == 0.1 else -1)
    path = joint_path(start, start + way, speed=share * JOINT_SPEED, acceleration=np.full(7, 2.0))
    robot.order("record")
    link.ask("move_joints", timeout_s=TIMEOUT_S, **plain_path(path))
    joints = recorded(robot, tmp_path)["joints"]
    assert len(joints) * TICK_S == pytest.approx(path.duration_s, rel=0.1)
    assert joints[-1] == pytest.approx(path.joints[-1], abs=1e-6)
    assert (np.abs(acceleration(joints)) < allowed_acceleration(path)).all()
    shares = (joints - joints[0]) @ way / (way @ way)
    assert np.abs(joints - joints[0] - shares[:, None] * way).max() < 2e-3  # all joints together


@pytest.fixture(scope="module")
def panda() -> Iterator[FakeRobot]:
    with fci5() as panda:
        yield panda


@pytest.mark.parametrize(("shift", "turn", "speed"), MOSTLY_SLOW)
def test_panda_py_is_commanded_along_a_straight_line_as_smooth_as_planned(
    panda: FakeRobot, tmp_path: Path, shift, turn: float, speed: float
):
    path_file, commands_file = tmp_path / "path.json", tmp_path / "commands.npz"
    path, goal = line_from(panda.joints(), shift, turn, speed)
    path_file.write_text(json.dumps(plain_path(path)))
    done = subprocess.run(
        [sys.executable, "-m", "tests.hal.franka.panda_py_recorder", panda.host, path_file, commands_file],
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
    )
    assert done.returncode == 0, done.stderr
    with np.load(commands_file) as file:
        seconds, joints, speeds = file["seconds"], file["joints"], file["speeds"]
    following = np.append(True, np.diff(seconds) > 0) & (seconds < path.duration_s) & (seconds > 0)
    seconds, joints, speeds = seconds[following], joints[following], speeds[following]
    assert seconds[-1] > path.duration_s - 0.05
    assert (
        off_line(forward(joints)[0][:, :3, 3], forward_pose(path.joints[0]).position, goal.position)
        < STRAIGHT_M
    )
    commanded = np.diff(speeds, axis=0) / np.diff(seconds)[:, None]
    assert (np.abs(commanded) < allowed_acceleration(path)).all()
    # Without steps: where two commands follow each other in time.
    steps = np.abs(np.diff(commanded, axis=0))[np.maximum(np.diff(seconds)[1:], np.diff(seconds)[:-1]) < 0.01]
    assert len(steps) > 50 and (steps < 0.3 * allowed_acceleration(path)).all()
    # The commanded speeds are those of the commanded joints.
    moved = (speeds[1:] + speeds[:-1]) / 2 * np.diff(seconds)[:, None]
    assert np.diff(joints, axis=0) == pytest.approx(moved, abs=1e-4)


@pytest.fixture(scope="module")
def free(robot: FakeRobot, link: DriverLink, tmp_path_factory: pytest.TempPathFactory) -> FakeRobot:
    """The same robot, let go by the link, as it takes no second client; it stands where it began."""
    link.close()
    with arm_at(tmp_path_factory.mktemp("free"), "franky", robot.host) as arm:
        arm.move_to_joints(np.array(DEFAULT_INITIAL_JOINT_POS), speed=1.0)
    return robot


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shift", "turn", "motions"),
    [
        ((-0.05, 0.06, 0.06), 0.4, 2),  # aslant to the axis of the turn
        ((0.05, -0.06, 0.0), -0.4, 1),  # across it
        ((0.0, 0.0, -0.06), 0.2, 1),  # along it
        ((0.02, 0.02, 0.02), 0.0, 1),
    ],
)
def test_with_franky_a_line_aslant_to_its_turn_is_two_motions_as_smooth_as_planned(
    free: FakeRobot, tmp_path: Path, shift, turn: float, motions: int
):
    with arm_at(tmp_path, "franky", free.host) as arm:
        state, config = arm.state(), arm._config
        matrix = state.T_base_tcp.as_matrix()
        matrix[:3, 3] += shift
        matrix[:3, :3] = matrix[:3, :3] @ Rotation.from_euler("z", turn).as_matrix()
        legs = arm._legs(Pose.from_matrix(matrix))
        free.order("record")
        arm.move_to_pose(legs[-1], speed=0.1)
        free.order(f"save {tmp_path / 'commands.npz'}")
        assert np.linalg.norm(arm.state().T_base_tcp.position - legs[-1].position) < 2e-3
    with np.load(tmp_path / "commands.npz") as file:
        ticks, poses = file["ticks"].astype(int), file["poses"]
    found = np.split(poses, 1 + np.flatnonzero(np.diff(ticks) > 1))
    assert len(found) == len(legs) == motions
    joints = state.joints
    for leg, poses in zip(legs, found, strict=True):
        path = straight_path(
            joints, leg, speed=min(0.1, config.max_speed), turn_speed=TURN_SPEED,
            acceleration=config.acceleration, turn_acceleration=config.joint_acceleration,
            joint_speed=config.max_joint_speed * JOINT_SPEED, lower=arm.limits.joint_lower,
            upper=arm.limits.joint_upper,
        )  # fmt: skip
        # The frame may be turned: at the end it is that of the leg.
        poses[:, :3, :3] = poses[:, :3, :3] @ poses[-1, :3, :3].T @ leg.as_matrix()[:3, :3]
        commanded = np.repeat(track(poses[::10], joints)[0], 10, axis=0)
        assert (np.abs(acceleration(commanded, 10)) < allowed_acceleration(path)).all()
        if motions == 1:
            assert off_line(poses[:, :3, 3], poses[0, :3, 3], leg.position) < STRAIGHT_M
        joints = commanded[-1]
