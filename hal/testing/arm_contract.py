"""Contract of every arm with a parallel gripper."""

from __future__ import annotations

import dataclasses
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from hal.arm import JOINT_TOLERANCE, POSITION_TOLERANCE, ROTATION_TOLERANCE, Arm
from hal.cell import Cell
from hal.errors import LoadTooHeavy, MotionAborted, NeedsRecovery, NotConnected, OutOfWorkspace, Stopped
from hal.execute import execute_grasp
from hal.hand import Load
from hal.limits import TOUCH_DEPTH
from mskgrasp.core.geometry import Pose, pose_distance, quat_multiply
from mskgrasp.core.grasp import Grasp, pose_base_tcp

BACK = Pose(position=np.array([0.0, 0.0, -0.06]), quat_wxyz=np.array([1.0, 0.0, 0.0, 0.0]))
"""Away from what the hand points at."""
STILL_RAD, STILL_M = 2e-3, 1e-3
"""A simulated arm creeps by this much when it stands."""


@contextmanager
def at_home(cell: Cell) -> Iterator[None]:
    """A connected cell without a fault, its fingers open, its arm at home; recovered at the end."""
    cell.arm.recover()
    cell.arm.open_gripper()
    cell.arm.move_to_joints(cell.workspace.home, speed=1.0)
    yield
    cell.arm.recover()


@contextmanager
def stopped_after(seconds: float | None, arm: Arm) -> Iterator[None]:
    """Call ``stop()`` from another thread after a time; None: a recording was stopped then."""
    timer = threading.Timer(600 if seconds is None else seconds, arm.stop)
    timer.start()
    try:
        yield
    finally:
        if seconds is None:
            timer.cancel()
        timer.join()


def joints_at_rest(arm: Arm) -> np.ndarray:
    """(n,) joints once they no longer change, radians."""
    deadline = time.monotonic() + 60
    last, quiet = arm.state().joints, 0
    while quiet < 3:
        assert time.monotonic() < deadline, "the arm goes on"
        time.sleep(0.1)
        now = arm.state().joints
        quiet = quiet + 1 if np.abs(now - last).max() < 1e-3 else 0
        last = now
    return last


def place(cell: Cell, *, x: float = 0.0, y: float = 0.0, z: float, theta: float = 0.0) -> Pose:
    """``T_base_tcp`` of a hand that points down, from the region's middle on the table, metres, radians."""
    offset = np.array([x, y, z])
    position = np.array([*cell.workspace.centre, cell.workspace.table_z]) + offset
    return pose_base_tcp(np.array([*position, theta]))


def over_the_table(cell: Cell, z: float = 0.3, theta: float = 0.0) -> Pose:
    """A place in the open, ``z`` metres over the table."""
    return place(cell, x=-0.08, y=0.05, z=z, theta=theta)


def touched(cell: Cell) -> Pose:
    """Below a point of the table where no part is."""
    return place(cell, x=-0.1, y=-0.1, z=-0.02)


def firmly(arm: Arm) -> float:
    """A force within the gripper's range, N."""
    return min(20.0, arm.limits.max_force)


class ArmContract:
    """Checks of an arm. A subclass, or its module, has two fixtures.

    ``world`` is a `Cell` whose arm is connected (module scope saves time): parts may lie in the middle of its
    region, and at x - 0.1 m, y - 0.1 m from there is nothing but the table. ``fresh_cell`` is one that is
    not connected. All that the checks move to lies within 0.1 m of the region's middle, up to 0.45 m over the
    table.
    """

    @pytest.fixture
    def cell(self, world: Cell) -> Iterator[Cell]:
        """Connected, at home, without a fault."""
        with at_home(world):
            yield world

    @pytest.fixture
    def stop_after_s(self) -> float | None:
        """Time after which motions are stopped, shorter than they last, s; None: the arm is a replay."""
        return 0.2

    def test_state_has_units_and_shapes(self, cell: Cell):
        state = cell.arm.state()
        limits = cell.arm.limits
        assert state.joints.shape == (limits.n_joints,) == limits.joint_upper.shape
        assert (state.joints > limits.joint_lower - STILL_RAD).all()
        assert (state.joints < limits.joint_upper + STILL_RAD).all()
        assert state.T_base_tcp.position.shape == (3,) and state.T_base_tcp.quat_wxyz.shape == (4,)
        assert np.linalg.norm(state.T_base_tcp.quat_wxyz) == pytest.approx(1.0, abs=1e-5)
        assert -STILL_M <= state.gripper_width <= limits.gripper.stroke + STILL_M
        assert state.timestamp_s <= time.monotonic()

    def test_a_joint_motion_arrives(self, cell: Cell):
        target = cell.workspace.home + np.resize(
            [0.2, 0.1, -0.1, 0.2, 0.1, -0.2, 0.2], cell.arm.limits.n_joints
        )
        cell.arm.move_to_joints(target, speed=0.8)
        assert cell.arm.state().joints == pytest.approx(target, abs=JOINT_TOLERANCE)

    @pytest.mark.parametrize("theta", [0.0, 1.2, -1.5])
    def test_a_straight_motion_arrives(self, cell: Cell, theta: float):
        target = over_the_table(cell, theta=theta)
        cell.arm.move_to_pose(target, speed=0.5)
        reached = cell.arm.state().T_base_tcp
        distance, angle = pose_distance(reached, target)
        assert distance < POSITION_TOLERANCE and angle < ROTATION_TOLERANCE

    def test_a_closed_hand_stands_where_it_touches_the_table_and_moves_on(self, cell: Cell):
        arm, target = cell.arm, touched(cell)
        arm.move_gripper(0.0)
        arm.move_to_pose(target @ BACK, speed=0.5)
        contact = arm.move_until_contact(target, force=5.0, speed=0.02)
        assert contact is not None
        table = cell.workspace.table_z
        assert contact.position == pytest.approx(
            [*target.position[:2], table + arm.limits.gripper.pad_reach], abs=1e-3
        )
        assert pose_distance(arm.state().T_base_tcp, contact)[0] < 1.5e-3
        arm.move_to_pose(target @ BACK, speed=0.5)  # a contact is no fault

    def test_a_hand_that_meets_nothing_arrives(self, cell: Cell):
        target = touched(cell) @ BACK
        cell.arm.move_gripper(0.0)
        assert cell.arm.move_until_contact(target @ BACK, speed=0.05) is None
        assert cell.arm.move_until_contact(target, speed=0.05) is None
        assert pose_distance(cell.arm.state().T_base_tcp, target)[0] < POSITION_TOLERANCE

    def test_the_gripper_reaches_a_width(self, cell: Cell):
        width = 0.4 * cell.arm.limits.gripper.stroke
        cell.arm.move_gripper(width)
        assert cell.arm.state().gripper_width == pytest.approx(width, abs=2e-3)

    def test_grasping_nothing_is_an_outcome(self, cell: Cell):
        outcome = cell.arm.grasp(firmly(cell.arm))
        assert not outcome.holding and outcome.width < 1e-3

    def test_a_hand_opens_as_far_as_it_does_and_knows_how_far(self, cell: Cell):
        cell.arm.move_gripper(0.25 * cell.arm.limits.gripper.stroke)
        cell.arm.open_gripper()
        state = cell.arm.state()
        assert state.max_width == pytest.approx(cell.arm.limits.gripper.stroke, abs=2e-3)
        assert state.gripper_width == pytest.approx(state.max_width, abs=2e-3)
        assert state.grasped in (False, None)

    def test_homing_moves_the_fingers_alone_and_the_hand_works_on(self, cell: Cell):
        before = cell.arm.state().joints
        cell.arm.home()
        assert cell.arm.state().joints == pytest.approx(before, abs=STILL_RAD)
        width = 0.4 * cell.arm.limits.gripper.stroke
        cell.arm.move_gripper(width)
        assert cell.arm.state().gripper_width == pytest.approx(width, abs=2e-3)

    def test_a_closed_hand_holds_by_the_same_rule_at_any_time(self, cell: Cell):
        outcome, state = cell.arm.grasp(firmly(cell.arm)), cell.arm.state()
        assert outcome.holding is cell.arm.holds(state) is False
        held = dataclasses.replace(state, gripper_width=0.02, grasped=None)
        assert cell.arm.holds(held) and not cell.arm.holds(dataclasses.replace(held, grasped=False))

    def test_a_part_in_the_hand_may_be_stated_unless_it_is_too_heavy(self, cell: Cell):
        arm, load = cell.arm, Load(mass=0.2, centre_tcp=np.zeros(3), inertia=1e-4 * np.eye(3))
        too_heavy = arm.limits.max_load + 10
        arm.set_load(load)
        with pytest.raises(LoadTooHeavy) as caught:
            arm.set_load(dataclasses.replace(load, mass=too_heavy))
        assert f"weighs {too_heavy:.3f} kg" in str(caught.value) and "\n" not in str(caught.value)
        before = arm.state().joints
        with pytest.raises(LoadTooHeavy):
            grasp = Grasp.from_vector(np.array([*cell.workspace.centre, cell.workspace.table_z + 0.02, 0.0]))
            execute_grasp(cell, grasp, load=dataclasses.replace(load, mass=too_heavy))
        assert arm.state().joints == pytest.approx(before, abs=STILL_RAD)
        arm.set_load(None)
        arm.set_load(load)
        arm.open_gripper()  # which releases it
        arm.move_gripper(0.06)  # a refusal is no fault

    def test_a_hand_that_has_closed_is_open_when_it_says_so(self, cell: Cell):
        cell.arm.grasp(firmly(cell.arm))
        width = 0.95 * cell.arm.limits.gripper.stroke
        cell.arm.move_gripper(width)
        assert cell.arm.state().gripper_width == pytest.approx(width, abs=2e-3)

    def test_a_command_outside_the_limits_is_refused_and_nothing_moves(self, cell: Cell):
        arm, limits, before = cell.arm, cell.arm.limits, cell.arm.state()
        home, first = cell.workspace.home, np.eye(limits.n_joints)[0]
        beyond = float(limits.box_upper[0] - cell.workspace.centre[0]) + 0.1
        for command in (
            lambda: arm.move_to_joints(home + first * (limits.joint_upper[0] - home[0] + 0.1)),
            lambda: arm.move_to_joints(home + first * np.nan),
            lambda: arm.move_to_joints(home[:-1]),
            lambda: arm.move_to_joints(home, speed=1.5),
            lambda: arm.move_to_pose(place(cell, z=0.005)),
            lambda: arm.move_to_pose(place(cell, x=beyond, z=0.2)),
            lambda: arm.move_to_pose(place(cell, y=np.nan, z=0.2)),
            lambda: arm.move_to_pose(over_the_table(cell), speed=0.0),
            lambda: arm.move_until_contact(touched(cell), force=50.0),
            lambda: arm.move_until_contact(touched(cell), speed=0.2),
            lambda: arm.move_until_contact(place(cell, z=-TOUCH_DEPTH - 0.01)),
            lambda: arm.move_until_contact(place(cell, x=beyond, z=0.0)),
            lambda: arm.move_gripper(limits.gripper.stroke + 0.1),
            lambda: arm.move_gripper(-0.01),
            lambda: arm.grasp(limits.max_force + 100),
            lambda: arm.grasp(0.0),
        ):
            with pytest.raises(OutOfWorkspace) as caught:
                command()
            assert "\n" not in str(caught.value)
        after = arm.state()
        assert after.joints == pytest.approx(before.joints, abs=STILL_RAD)
        assert after.gripper_width == pytest.approx(before.gripper_width, abs=STILL_M)
        arm.move_gripper(0.06)  # a refusal is no fault

    def test_a_tilted_hand_keeps_its_corners_off_the_table(self, cell: Cell):
        level = place(cell, z=cell.arm.limits.gripper.pad_reach + 0.0105)
        tilted = Pose(
            position=level.position,
            quat_wxyz=quat_multiply(np.array([np.cos(0.3), np.sin(0.3), 0.0, 0.0]), level.quat_wxyz),
        )
        cell.arm.check_pose(level)
        with pytest.raises(OutOfWorkspace, match="table"):
            cell.arm.check_pose(tilted)

    def test_stop_from_another_thread_ends_a_motion_and_nothing_moves_before_recover(
        self, cell: Cell, stop_after_s: float | None
    ):
        far = cell.workspace.home + 0.5 * np.eye(cell.arm.limits.n_joints)[0]
        with stopped_after(stop_after_s, cell.arm):
            with pytest.raises((Stopped, NeedsRecovery), match="stop"):
                for k in range(200):  # a simulated motion may be quicker than the timer
                    cell.arm.move_to_joints(far if k % 2 == 0 else cell.workspace.home)
        stopped = joints_at_rest(cell.arm)
        with pytest.raises(NeedsRecovery, match=r"recover\(\)"):
            cell.arm.move_to_joints(cell.workspace.home, speed=1.0)
        with pytest.raises(NeedsRecovery, match=r"recover\(\)"):
            cell.arm.grasp(firmly(cell.arm))
        assert cell.arm.state().joints == pytest.approx(stopped, abs=1e-2)
        cell.arm.recover()
        cell.arm.move_to_joints(cell.workspace.home, speed=1.0)
        assert cell.arm.state().joints == pytest.approx(cell.workspace.home, abs=JOINT_TOLERANCE)

    @pytest.mark.parametrize(
        "command",
        [
            lambda cell, k: cell.arm.move_gripper(0.02 if k % 2 == 0 else 0.06),
            lambda cell, k: cell.arm.grasp(firmly(cell.arm)),
            lambda cell, k: cell.arm.wait(5.0),
            lambda cell, k: cell.arm.move_to_pose(over_the_table(cell, 0.3 if k % 2 == 0 else 0.35)),
            lambda cell, k: cell.arm.move_until_contact(
                over_the_table(cell, 0.45 if k % 2 == 0 else 0.4), speed=0.05
            ),
        ],
        ids=["gripper", "grasp", "wait", "line", "touch"],
    )
    def test_stop_ends_every_kind_of_motion(self, cell: Cell, stop_after_s: float | None, command):
        with stopped_after(stop_after_s, cell.arm):
            with pytest.raises((Stopped, NeedsRecovery), match="stop"):
                for k in range(200):  # a simulated motion may be quicker than the timer
                    command(cell, k)
        with pytest.raises(NeedsRecovery):
            command(cell, 0)

    def test_an_interrupted_program_leaves_an_arm_that_must_be_recovered(
        self, cell: Cell, stop_after_s: float | None, monkeypatch
    ):
        def interrupt(*_: object) -> None:
            raise KeyboardInterrupt

        moved = getattr(cell.arm, "_arm", cell.arm)  # of a recorded arm, the one that moves
        with monkeypatch.context() as patch:
            patch.setattr(moved, "_move_to_joints", interrupt)
            # A recorded Ctrl-C must not end the program that plays it back.
            with pytest.raises(MotionAborted if stop_after_s is None else KeyboardInterrupt):
                cell.arm.move_to_joints(cell.workspace.home, speed=1.0)
        with pytest.raises(NeedsRecovery):
            cell.arm.move_gripper(0.05)

    def test_an_arm_outside_its_context_refuses_and_can_be_opened_again(self, fresh_cell: Cell):
        cell = fresh_cell
        arm = cell.arm
        moves = (arm.home, arm.open_gripper, lambda: arm.move_gripper(0.05), lambda: arm.set_load(None))
        for command in (arm.state, arm.recover, *moves):
            with pytest.raises(NotConnected):
                command()
        cell.arm.close()
        for _ in range(2):
            with cell.arm:
                cell.arm.move_gripper(0.05)
                assert cell.arm.state().gripper_width == pytest.approx(0.05, abs=2e-3)
            cell.arm.close()
        with pytest.raises(NotConnected):
            cell.arm.state()
