"""The paths on which the MuJoCo arm is sent: straight, bounded, from rest to rest."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from hal import Cell
from hal.arm import JOINT_TOLERANCE
from hal.errors import MotionAborted
from hal.mujoco import MujocoCellConfig, mujoco_cell
from hal.mujoco.world import MujocoWorld
from hal.simulated import JOINT_ACCELERATION, JOINT_SPEED, PEAK_ACCELERATION
from mskgrasp.core.grasp import pose_base_tcp
from mskgrasp.core.panda_kinematics import forward_pose
from tests.hal.watching import check_watching


@pytest.fixture(scope="module")
def cell() -> Iterator[Cell]:
    with mujoco_cell(MujocoCellConfig(type="mujoco")).connected() as cell:
        yield cell


@pytest.fixture
def paths(cell: Cell, monkeypatch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """Joints (k, 7) of each motion from now on, a simulation step apart."""
    world = cell.feeder
    assert isinstance(world, MujocoWorld)
    cell.arm.recover()
    cell.arm.move_to_joints(cell.workspace.home)
    seen: list[np.ndarray] = []
    follow = world.simulation.follow

    def watched(joints: np.ndarray, **settings) -> bool:
        seen.append(joints.copy())
        return follow(joints, **settings)

    monkeypatch.setattr(world.simulation, "follow", watched)
    return seen


STEP_S = 1e-3


@pytest.mark.parametrize("speed", [0.1, 0.5, 1.0])
def test_a_joint_motion_keeps_its_share_of_the_speed(cell: Cell, paths: list[np.ndarray], speed: float):
    way = np.array([0.6, 0.1, -0.3, 0.2, 0.0, -0.2, 0.4])
    cell.arm.move_to_joints(cell.workspace.home + way, speed=speed)
    (path,) = paths
    assert path[0] == pytest.approx(cell.workspace.home, abs=1e-6)
    assert path[-1] == pytest.approx(cell.workspace.home + way, abs=1e-12)
    speeds = np.diff(path, axis=0) / STEP_S
    assert np.abs(speeds).max() <= 1.001 * speed * JOINT_SPEED
    assert np.abs(np.diff(speeds, axis=0) / STEP_S).max() <= 1.01 * JOINT_ACCELERATION
    assert np.abs(speeds[[0, -1]]).max() < 0.01
    # All joints begin and end together.
    shares = (path - path[0])[:, way != 0] / way[way != 0]
    assert np.ptp(shares, axis=1).max() < 1e-9


@pytest.mark.parametrize(("speed", "turn"), [(0.1, 0.0), (0.5, 0.0), (0.3, 0.8)])
def test_a_straight_motion_keeps_line_speed_and_acceleration(
    cell: Cell, paths: list[np.ndarray], speed: float, turn: float
):
    goal = pose_base_tcp(np.array([0.45, 0.2, 0.3, turn]))
    cell.arm.move_to_pose(goal, speed=speed)
    (path,) = paths
    points = forward_pose(path).position
    begin, way = points[0], goal.position - points[0]
    along = (points - begin) @ way / np.linalg.norm(way)
    off = points - begin - along[:, None] * way / np.linalg.norm(way)
    assert np.linalg.norm(off, axis=1).max() < 1e-4
    assert along[-1] == pytest.approx(np.linalg.norm(way), abs=1e-5)
    speeds = np.diff(along) / STEP_S
    assert speeds.min() > -1e-4 and speeds.max() <= 1.01 * speed
    assert np.abs(np.diff(speeds) / STEP_S).max() <= 1.15 * PEAK_ACCELERATION


def test_after_contact_the_arm_rests_where_it_met_something(cell: Cell, paths: list[np.ndarray]):
    """A finger on the nut: it presses by less than the reflex, and the next path begins where the arm is."""
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("hex_nut_m30", 0)
    x, y, _ = cell.tracker.part_pose().position
    cell.arm.move_to_pose(pose_base_tcp(np.array([x, y - 0.065, 0.12, 0.0])), speed=0.3)
    with pytest.raises(MotionAborted, match="contact force over 20 N"):
        cell.arm.move_to_pose(pose_base_tcp(np.array([x, y - 0.065, 0.0115, 0.0])), speed=0.2)
    cell.arm.recover()
    world = cell.feeder
    assert isinstance(world, MujocoWorld)
    assert world.simulation.target == pytest.approx(world.simulation.joints, abs=JOINT_TOLERANCE)
    assert world.simulation.load() < world.physics.reflex_force


def test_who_watches_a_motion_sees_the_arm_on_its_way_and_nothing_afterwards(cell: Cell):
    check_watching(cell)
