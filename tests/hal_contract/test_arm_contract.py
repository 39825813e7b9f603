"""What every arm promises."""

from __future__ import annotations

import dataclasses
import threading
import time

import numpy as np
import pytest

from hal import Cell, cell_from_yaml, execute_grasp, go_home, put_down
from hal.errors import MotionAborted, NeedsRecovery, NotConnected, OutOfWorkspace
from mskgrasp.geometry import Pose, quat_multiply
from mskgrasp.grasp import pose_base_tcp
from tests.hal_contract.conftest import CELLS


def over_the_table(z: float = 0.15, theta: float = 0.0) -> Pose:
    return pose_base_tcp(np.array([0.5, 0.05, z, theta]))


def test_state_has_units_and_shapes(cell: Cell):
    state = cell.arm.state()
    assert state.joints.shape == (7,) and np.abs(state.joints).max() < 3.8
    assert state.T_base_tcp.position.shape == (3,) and state.T_base_tcp.quat_wxyz.shape == (4,)
    assert np.linalg.norm(state.T_base_tcp.quat_wxyz) == pytest.approx(1.0, abs=1e-5)
    assert 0 <= state.gripper_width <= 0.081
    assert state.timestamp_s <= time.monotonic()


def test_a_joint_motion_arrives(cell: Cell):
    target = cell.workspace.home + np.array([0.3, 0.1, -0.1, 0.2, 0.1, -0.2, 0.3])
    cell.arm.move_to_joints(target)
    assert cell.arm.state().joints == pytest.approx(target, abs=5e-3)


@pytest.mark.parametrize("theta", [0.0, 1.2, -1.5])
def test_a_straight_motion_arrives(cell: Cell, theta: float):
    target = over_the_table(theta=theta)
    cell.arm.move_to_pose(target)
    reached = cell.arm.state().T_base_tcp
    assert reached.position == pytest.approx(target.position, abs=1e-3)
    assert abs(np.dot(reached.quat_wxyz, target.quat_wxyz)) == pytest.approx(1.0, abs=1e-5)


def test_the_gripper_reaches_a_width(cell: Cell):
    cell.arm.move_gripper(0.03)
    assert cell.arm.state().gripper_width == pytest.approx(0.03, abs=2e-3)


def test_grasping_nothing_is_an_outcome(cell: Cell):
    cell.arm.move_to_pose(over_the_table())
    outcome = cell.arm.grasp(20.0)
    assert not outcome.holding and outcome.width < 1e-3


@pytest.mark.parametrize(
    "command",
    [
        lambda arm: arm.move_to_joints(np.array([0, 0, 0, 0.5, 0, 1.5, 0])),
        lambda arm: arm.move_to_joints(np.array([0, 0, 0, np.nan, 0, 1.5, 0])),
        lambda arm: arm.move_to_joints(np.zeros(6)),
        lambda arm: arm.move_to_pose(pose_base_tcp(np.array([0.5, 0.0, 0.005, 0.0]))),
        lambda arm: arm.move_to_pose(pose_base_tcp(np.array([1.5, 0.0, 0.2, 0.0]))),
        lambda arm: arm.move_to_pose(pose_base_tcp(np.array([0.5, np.nan, 0.2, 0.0]))),
        lambda arm: arm.move_gripper(0.2),
        lambda arm: arm.move_gripper(-0.01),
        lambda arm: arm.grasp(500.0),
        lambda arm: arm.grasp(0.0),
    ],
)
def test_a_command_outside_the_limits_is_refused_and_nothing_moves(cell: Cell, command):
    before = cell.arm.state()
    with pytest.raises(OutOfWorkspace) as caught:
        command(cell.arm)
    assert "\n" not in str(caught.value)
    after = cell.arm.state()
    assert after.joints == pytest.approx(before.joints, abs=1e-4)
    assert after.gripper_width == pytest.approx(before.gripper_width, abs=1e-4)
    cell.arm.move_gripper(0.06)  # a refusal is no fault


def test_stop_from_another_thread_ends_a_motion_and_nothing_moves_before_recover(cell: Cell):
    far = cell.workspace.home + np.array([0.5, 0, 0, 0, 0, 0, 0])
    timer = threading.Timer(0.05, cell.arm.stop)
    timer.start()
    with pytest.raises((MotionAborted, NeedsRecovery), match="stop"):
        for k in range(200):  # a simulated motion may be quicker than the timer
            cell.arm.move_to_joints(far if k % 2 == 0 else cell.workspace.home)
    timer.join()
    stopped = cell.arm.state().joints
    with pytest.raises(NeedsRecovery, match=r"recover\(\)"):
        cell.arm.move_to_joints(cell.workspace.home)
    assert cell.arm.state().joints == pytest.approx(stopped, abs=1e-2)
    cell.arm.recover()
    cell.arm.move_to_joints(cell.workspace.home)
    assert cell.arm.state().joints == pytest.approx(cell.workspace.home, abs=5e-3)


def test_an_interrupted_program_leaves_an_arm_that_must_be_recovered(cell: Cell, monkeypatch):
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(cell.arm, "_move_to_joints", interrupt)
        with pytest.raises(KeyboardInterrupt):
            cell.arm.move_to_joints(cell.workspace.home)
    with pytest.raises(NeedsRecovery):
        cell.arm.move_gripper(0.05)


def test_an_arm_outside_its_context_refuses():
    arm = cell_from_yaml(CELLS / "sapien.yaml").arm
    for command in (arm.state, arm.recover, lambda: arm.move_gripper(0.05)):
        with pytest.raises(NotConnected):
            command()
    arm.close()
    arm.close()


def test_a_cell_can_be_opened_again(closed_cell: Cell):
    other = cell_from_yaml(CELLS / "sapien.yaml")
    for _ in range(2):
        with other.connected():
            assert other.arm.state().joints == pytest.approx(other.workspace.home, abs=5e-3)


def test_a_descent_onto_a_part_stops_like_a_reflex(cell: Cell):
    """A finger over the rim of the nut: the arm must not push through it."""
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("hex_nut_m30", 0)
    x, y, _ = cell.tracker.part_pose().position
    cell.arm.move_to_pose(pose_base_tcp(np.array([x, y - 0.065, 0.12, 0.0])))
    with pytest.raises(MotionAborted, match="contact force"):
        cell.arm.move_to_pose(pose_base_tcp(np.array([x, y - 0.065, 0.0115, 0.0])))
    assert cell.arm.state().T_base_tcp.position[2] > 0.02
    with pytest.raises(NeedsRecovery):
        cell.arm.move_gripper(0.05)
    cell.arm.recover()
    cell.arm.move_to_pose(pose_base_tcp(np.array([x, y - 0.065, 0.12, 0.0])))


def test_a_grasp_lifts_a_part_and_the_simulator_agrees(cell: Cell):
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("hex_nut_m30", 0)
    before = cell.tracker.part_pose().position
    result = execute_grasp(cell, np.array([before[0], before[1], 0.0115, 0.3]))
    assert result.holding and result.aborted is None
    rise = cell.tracker.part_pose().position[2] - before[2]
    assert rise == pytest.approx(cell.workspace.lift_height, abs=2e-3)
    assert 0.04 < result.width < 0.06
    put_down(cell, np.array([before[0], before[1], 0.0115, 0.3]))
    go_home(cell)
    assert cell.tracker.part_pose().position == pytest.approx(before, abs=2e-3)


@pytest.mark.parametrize("force", [5.0, 20.0, 70.0])
def test_a_part_is_lifted_whatever_the_grip_force(cell: Cell, force: float):
    """The reflex must not take the commanded grip for a collision."""
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("hex_nut_m30", 0)
    before = cell.tracker.part_pose().position
    firm = dataclasses.replace(cell, workspace=dataclasses.replace(cell.workspace, grasp_force=force))
    result = execute_grasp(firm, np.array([before[0], before[1], 0.0115, 0.3]))
    assert result.aborted is None and result.holding
    go_home(firm)
    assert cell.arm.state().joints == pytest.approx(cell.workspace.home, abs=5e-3)


@pytest.mark.parametrize(
    "command",
    [
        lambda arm: arm.move_gripper(0.02),
        lambda arm: arm.grasp(20.0),
        lambda arm: arm.wait(5.0),
        lambda arm: arm.move_to_pose(over_the_table(0.3)),
    ],
)
def test_stop_ends_every_kind_of_motion(cell: Cell, command):
    timer = threading.Timer(0.005, cell.arm.stop)
    timer.start()
    with pytest.raises((MotionAborted, NeedsRecovery), match="stop"):
        for _ in range(200):  # a simulated motion may be quicker than the timer
            command(cell.arm)
    timer.join()
    with pytest.raises(NeedsRecovery):
        command(cell.arm)


def test_joints_that_bring_the_hand_into_the_table_are_refused(cell: Cell):
    before = cell.arm.state().joints
    with pytest.raises(OutOfWorkspace, match="table"):
        cell.arm.move_to_joints(np.array([0.0, 0.9, 0.0, -1.9, 0.0, 2.8, 0.785]))
    assert cell.arm.state().joints == pytest.approx(before, abs=1e-4)


def test_a_tilted_hand_keeps_its_corners_off_the_table(cell: Cell):
    level = pose_base_tcp(np.array([0.5, 0.0, 0.02, 0.0]))
    tilted = Pose(
        position=level.position,
        quat_wxyz=quat_multiply(np.array([np.cos(0.3), np.sin(0.3), 0.0, 0.0]), level.quat_wxyz),
    )
    cell.arm.check_pose(level)
    with pytest.raises(OutOfWorkspace, match="table"):
        cell.arm.check_pose(tilted)


def test_a_grasp_out_of_reach_is_refused_before_anything_moves(cell: Cell):
    cell.arm.move_gripper(0.03)
    before = cell.arm.state()
    with pytest.raises(OutOfWorkspace, match="reach"):
        execute_grasp(cell, np.array([0.74, 0.39, 0.02, 0.0]))
    after = cell.arm.state()
    assert after.joints == pytest.approx(before.joints, abs=1e-4)
    assert after.gripper_width == pytest.approx(before.gripper_width, abs=1e-4)
