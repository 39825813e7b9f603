"""Simulated cells beyond the contract: contact with parts, and the true pose."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Callable

import numpy as np
import pytest

from hal import Cell, execute_grasp, go_home, let_go, put_down
from hal.errors import MotionAborted, NeedsRecovery, Stopped
from hal.mujoco.world import MujocoWorld
from hal.sim.world import SapienWorld
from mskgrasp.core.grasp import Grasp, pose_base_tcp
from mskgrasp.planning.place_pose import place


def after_every_step(cell: Cell, monkeypatch: pytest.MonkeyPatch, do: Callable[[], object]) -> None:
    """Call something after every simulated step of the part that is on the table now."""
    world = cell.feeder
    assert isinstance(world, SapienWorld | MujocoWorld)
    steps = (world.env.motion, "step") if isinstance(world, SapienWorld) else (world.simulation, "_step")
    step = getattr(*steps)

    def step_and_do(*args: object) -> None:
        step(*args)
        do()

    monkeypatch.setattr(*steps, step_and_do)


@pytest.mark.parametrize("theta", [0.0, 1.2, -1.5])
def test_a_straight_motion_arrives_to_a_millimetre(cell: Cell, theta: float):
    target = pose_base_tcp(np.array([0.5, 0.05, 0.15, theta]))
    cell.arm.move_to_pose(target)
    reached = cell.arm.state().T_base_tcp
    assert reached.position == pytest.approx(target.position, abs=1e-3)
    assert abs(np.dot(reached.quat_wxyz, target.quat_wxyz)) == pytest.approx(1.0, abs=1e-5)


def test_a_straight_motion_is_straight(cell: Cell, monkeypatch):
    begin, target = cell.arm.state().T_base_tcp.position, pose_base_tcp(np.array([0.5, 0.1, 0.15, 0.0]))
    seen: list[np.ndarray] = []
    after_every_step(cell, monkeypatch, lambda: seen.append(cell.arm.state().T_base_tcp.position))
    cell.arm.grasp(5.0)  # closed fingers might hold something, so that no air is skipped
    cell.arm.move_to_pose(target, speed=0.3)
    way = (target.position - begin) / np.linalg.norm(target.position - begin)
    offsets = [p - begin - way * np.dot(p - begin, way) for p in seen]
    assert len(seen) > 50
    assert max(float(np.linalg.norm(offset)) for offset in offsets) < 1e-3


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
    result = execute_grasp(cell, Grasp.from_vector(np.array([before[0], before[1], 0.0115, 0.3])))
    assert result.holding and result.aborted is None
    rise = cell.tracker.part_pose().position[2] - before[2]
    assert rise == pytest.approx(cell.workspace.lift_height, abs=2e-3)
    assert 0.04 < result.width < 0.06
    put_down(cell, Grasp.from_vector(np.array([before[0], before[1], 0.0115, 0.3])))
    go_home(cell)
    assert cell.tracker.part_pose().position == pytest.approx(before, abs=2e-3)


@pytest.mark.parametrize(
    "force", [pytest.param(5.0, marks=pytest.mark.slow), pytest.param(20.0, marks=pytest.mark.slow), 70.0]
)
def test_a_part_is_lifted_whatever_the_grip_force(cell: Cell, force: float):
    """The reflex must not take the commanded grip for a collision."""
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("hex_nut_m30", 0)
    before = cell.tracker.part_pose().position
    firm = dataclasses.replace(cell, workspace=dataclasses.replace(cell.workspace, grasp_force=force))
    result = execute_grasp(firm, Grasp.from_vector(np.array([before[0], before[1], 0.0115, 0.3])))
    assert result.aborted is None and result.holding
    go_home(firm)
    assert cell.arm.state().joints == pytest.approx(cell.workspace.home, abs=5e-3)


def test_a_part_that_the_grip_itself_presses_on_the_table_is_lifted(cell: Cell):
    """Pads that close in the groove of a pulley wedge it down with more than the reflex allows."""
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("v_pulley_56x1x66", 1080180507)
    before = cell.tracker.part_pose().position
    result = execute_grasp(cell, Grasp.from_vector(np.array([0.4576, 0.0045, 0.0483, 0.9098])))
    assert result.aborted is None and result.holding
    assert cell.tracker.part_pose().position[2] > before[2] + 0.8 * cell.workspace.lift_height
    go_home(cell)


def test_a_held_part_that_is_pressed_on_the_table_stops_the_arm(cell: Cell):
    """Pads that grip with 40 N push with up to 2 mu F = 40 N before they slide; the reflex is set to 20 N."""
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("hex_nut_m30", 0)
    x, y, _ = cell.tracker.part_pose().position
    firm = dataclasses.replace(cell, workspace=dataclasses.replace(cell.workspace, grasp_force=40.0))
    assert execute_grasp(firm, Grasp.from_vector(np.array([x, y, 0.019, 0.3]))).holding
    with pytest.raises(MotionAborted, match="contact force over 20 N"):
        cell.arm.move_to_pose(pose_base_tcp(np.array([x, y, 0.0115, 0.3])))
    cell.arm.recover()
    go_home(cell)


def test_a_part_that_meets_the_table_early_is_let_go_there(cell: Cell):
    """The hand is sent 6 mm too low."""
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("hex_nut_m30", 0)
    before = cell.tracker.part_pose().position
    firm = dataclasses.replace(cell, workspace=dataclasses.replace(cell.workspace, grasp_force=40.0))
    assert execute_grasp(firm, Grasp.from_vector(np.array([before[0], before[1], 0.019, 0.3]))).holding
    stops: list[MotionAborted] = []

    def recover(error: MotionAborted) -> None:
        stops.append(error)
        cell.arm.recover()

    place(firm, Grasp.from_vector(np.array([before[0] + 0.02, before[1], 0.013, 0.3])), recover)
    assert len(stops) == 1
    assert cell.tracker.part_pose().position == pytest.approx(before + [0.02, 0, 0], abs=3e-3)
    go_home(cell)


def test_a_part_that_falls_from_the_hand_does_not_stop_the_arm(cell: Cell):
    """What it does to the table when it lands is no force on the hand any more."""
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("hex_nut_m30", 0)
    before = cell.tracker.part_pose().position
    assert execute_grasp(cell, Grasp.from_vector(np.array([before[0], before[1], 0.0115, 0.3]))).holding
    world = cell.feeder
    assert isinstance(world, SapienWorld | MujocoWorld)
    weaken = (
        world.env.agent.set_finger_force
        if isinstance(world, SapienWorld)
        else world.simulation._limit_fingers
    )
    weaken(0.01)
    cell.arm.move_to_pose(pose_base_tcp(np.array([before[0], before[1], 0.17, 0.3])))
    weaken(20.0)
    assert cell.tracker.part_pose().position[2] < before[2] + 0.01
    go_home(cell)


def test_a_stop_is_no_outcome_of_a_grasp(cell: Cell, monkeypatch: pytest.MonkeyPatch):
    """The arm is stopped in the middle of its descent."""
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("hex_nut_m30", 0)
    x, y, _ = cell.tracker.part_pose().position
    stopped_at: list[float] = []

    def stop_once_low() -> None:
        height = cell.arm.state().T_base_tcp.position[2]
        if not stopped_at and height < 0.05:
            stopped_at.append(height)
            stopping = threading.Thread(target=cell.arm.stop)
            stopping.start()
            stopping.join()

    after_every_step(cell, monkeypatch, stop_once_low)
    with pytest.raises(Stopped):
        execute_grasp(cell, Grasp.from_vector(np.array([x, y, 0.0115, 0.3])))
    assert cell.arm.state().T_base_tcp.position[2] > stopped_at[0] - 0.01
    cell.arm.recover()
    go_home(cell)


@pytest.mark.parametrize("opening", [-0.01, 0.09, float("nan")])
def test_fingers_cannot_let_go_by_any_opening(cell: Cell, opening: float):
    with pytest.raises(ValueError, match="outside 0"):
        let_go(cell, Grasp.from_vector(np.array([0.5, 0.0, 0.1, 0.0])), opening=opening)


@pytest.mark.parametrize(
    ("opening", "pushed"), [pytest.param(0.08, True, marks=pytest.mark.slow), (0.041, False)]
)
def test_a_finger_in_a_bore_leaves_the_part_where_it_is_if_it_opens_no_farther_than_it_must(
    cell: Cell, opening: float, pushed: bool
):
    """A ring is gripped by its wall and drawn aside; open all the way, the inner finger pushes it on."""
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("shaft_collar_45", 836804417)
    grasp = Grasp.from_vector(np.array([0.5128, -0.0410, 0.01365, 0.7254]))
    before = cell.tracker.part_pose().position
    assert execute_grasp(cell, grasp).holding
    held = cell.tracker.part_pose().position
    assert np.hypot(*(held - before)[:2]) > 0.014
    put_down(cell, grasp, height=0.0, opening=opening)
    go_home(cell)
    moved = float(np.hypot(*(cell.tracker.part_pose().position - held)[:2]))
    assert moved > 0.004 if pushed else moved < 0.0003
