"""The motions of a grasp, on an arm that is at once where it is sent and writes down what it is asked."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from hal import Cell, GraspOutcome, Load, capture_at_home, execute_grasp, go_home, let_go, put_down
from hal.errors import (
    ArmInView,
    HandFull,
    LoadTooHeavy,
    NeedsRecovery,
    NotCalibrated,
    OutOfWorkspace,
    Stopped,
)
from hal.execute import above_grasp, lower
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import Grasp
from tests.hal.replay.toy import ToyArm, ToyCamera, toy_cell

GRASP = Grasp.from_vector(np.array([0.4, 0.1, 0.06, 0.3]))


class WritingArm(ToyArm):
    """Notes the verbs that move it."""

    def __init__(self) -> None:
        super().__init__()
        self.log: list[tuple[str, Any]] = []
        self.between = 0.031

    def _move_to_joints(self, joints: np.ndarray, speed: float) -> None:
        self.log.append(("joints", joints.tolist()))
        super()._move_to_joints(joints, speed)

    def _move_to_pose(self, T_base_tcp: Pose, speed: float) -> None:
        self.log.append(("pose", T_base_tcp.position.round(6).tolist()))
        super()._move_to_pose(T_base_tcp, speed)

    def _move_gripper(self, width: float) -> None:
        self.log.append(("gripper", round(width, 6)))
        super()._move_gripper(width)

    def _grasp(self, force: float) -> GraspOutcome:
        self.log.append(("grasp", force))
        self._width = self.between
        return GraspOutcome(width=self.between, holding=self.between > 0)

    def _set_load(self, load: Load | None) -> None:
        self.log.append(("load", None if load is None else load.mass))

    def _wait(self, seconds: float) -> None:
        self.log.append(("wait", seconds))


@pytest.fixture
def arm() -> WritingArm:
    return WritingArm()


@pytest.fixture
def cell(arm: WritingArm) -> Cell:
    arm.connect()
    return dataclasses.replace(toy_cell(), arm=arm)


def test_a_grasp_is_open_above_down_close_lift_hold(cell: Cell, arm: WritingArm):
    """The table is at 0: 12 cm above it the straight descent begins; the lift is 10 cm."""
    result = execute_grasp(cell, GRASP)
    assert arm.log == [
        ("gripper", 0.08),
        ("pose", [0.4, 0.1, 0.12]),
        ("pose", [0.4, 0.1, 0.06]),
        ("grasp", 20.0),
        ("pose", [0.4, 0.1, 0.16]),
        ("wait", 0.2),
    ]
    assert (result.lifted, result.holding, result.aborted) == (True, True, None)
    assert result.width == 0.031 and result.T_base_tcp.position[2] == pytest.approx(0.16)


def test_the_hand_comes_from_above_a_tall_part_too(cell: Cell):
    high = Grasp.from_vector(np.array([0.4, 0.0, 0.2, 0.0]))
    assert above_grasp(cell, high).position == pytest.approx([0.4, 0.0, 0.22])
    raised = dataclasses.replace(cell, workspace=dataclasses.replace(cell.workspace, table_z=0.05))
    assert above_grasp(raised, GRASP).position == pytest.approx([0.4, 0.1, 0.17])
    assert above_grasp(cell, GRASP).quat_wxyz == pytest.approx(GRASP.T_base_tcp.quat_wxyz)


def test_the_hand_comes_from_above_the_tallest_thing_and_rises_over_it(cell: Cell, arm: WritingArm):
    """A neighbour of 20 cm: the pads, 9.5 mm below the TCP, pass 15 mm over it."""
    assert above_grasp(cell, GRASP, tallest=0.2).position == pytest.approx([0.4, 0.1, 0.2245])
    assert above_grasp(cell, GRASP, tallest=0.09).position == pytest.approx([0.4, 0.1, 0.12])
    execute_grasp(cell, GRASP, tallest=0.2)
    assert arm.log[1] == ("pose", [0.4, 0.1, 0.2245])
    arm.log.clear()
    put_down(cell, GRASP, tallest=0.2)
    assert arm.log[-1] == ("pose", [0.4, 0.1, 0.2245])
    arm.log.clear()
    go_home(cell, tallest=0.3)
    assert arm.log[1] == ("pose", [0.4, 0.1, 0.3245])


def test_a_simulated_hand_puts_down_what_it_holds_before_it_goes_home(cell: Cell, arm: WritingArm):
    arm.simulated = True
    execute_grasp(cell, GRASP)
    arm.log.clear()
    go_home(cell)
    assert arm.log[:2] == [("pose", [0.4, 0.1, 0.062]), ("gripper", 0.08)]
    assert arm.log[-1] == ("joints", cell.workspace.home.tolist()) and arm.in_hand() is None


def test_a_simulated_part_that_meets_something_on_its_way_down_is_released_there(cell: Cell, arm: WritingArm):
    """The toy arm meets something below 5 cm."""
    arm.simulated = True
    arm.move_to_pose(Pose(position=np.array([0.4, 0.1, 0.05]), quat_wxyz=GRASP.T_base_tcp.quat_wxyz))
    arm.grasp(20.0)
    arm._held = dataclasses.replace(arm._held, T_base_tcp=GRASP.raised(-0.03).T_base_tcp)  # type: ignore[type-var]
    go_home(cell)
    assert arm.log[-1] == ("joints", cell.workspace.home.tolist())


def test_a_real_hand_does_not_drop_what_it_holds(cell: Cell, arm: WritingArm):
    execute_grasp(cell, GRASP)
    arm.log.clear()
    with pytest.raises(HandFull, match=r"put it down \(hal.put_down\), or take it and open") as caught:
        go_home(cell)
    assert arm.log == [] and "\n" not in str(caught.value)
    arm.wait(0.1)  # a refusal is no fault
    arm.log.clear()
    asked: list[int] = []
    go_home(cell, take=lambda: bool(asked.append(len(arm.log)) or True))
    assert asked == [0] and arm.log[0] == ("gripper", 0.08)  # a person holds it as the fingers open


def test_a_real_hand_that_no_one_watches_puts_down_what_it_holds(cell: Cell, arm: WritingArm):
    execute_grasp(cell, GRASP)
    arm.log.clear()
    go_home(cell, take=lambda: False)
    assert arm.log[:2] == [("pose", [0.4, 0.1, 0.062]), ("gripper", 0.08)]


def test_fingers_that_moved_since_they_closed_hold_nothing(cell: Cell, arm: WritingArm):
    assert arm.in_hand() is None
    execute_grasp(cell, GRASP)
    held = arm.in_hand()
    assert held is not None and held.width == 0.031
    assert held.T_base_tcp.position == pytest.approx([0.4, 0.1, 0.06])  # where they closed, not where it is
    arm._width = 0.0  # slipped out
    assert arm.in_hand() is None
    go_home(cell)


def test_what_an_earlier_program_left_in_the_hand_is_not_dropped(cell: Cell, arm: WritingArm, monkeypatch):
    state = arm._state
    monkeypatch.setattr(arm, "_state", lambda: dataclasses.replace(state(), grasped=True))
    arm._width = 0.03
    held = arm.in_hand()
    assert held is not None and held.T_base_tcp is None and held.width == 0.03
    for take in (None, lambda: False):
        with pytest.raises(HandFull, match="run python -m hal.home, which opens") as caught:
            go_home(cell, take=take)
        assert arm.log == [] and "\n" not in str(caught.value)
    go_home(cell, take=lambda: True)
    assert arm.log[0] == ("gripper", 0.08) and arm.in_hand() is None
    arm._width = 0.03  # from here on this program knows what its fingers did, whatever the hand says
    assert arm.in_hand() is None


def test_a_hand_that_is_open_holds_nothing_whatever_it_reports(cell: Cell, arm: WritingArm, monkeypatch):
    state = arm._state
    monkeypatch.setattr(arm, "_state", lambda: dataclasses.replace(state(), grasped=True))
    assert arm.in_hand() is None
    go_home(cell)


def test_a_frame_is_taken_for_a_plan_at_home_only(cell: Cell, arm: WritingArm):
    arm.move_to_joints(cell.workspace.home)
    assert capture_at_home(cell).serial == "toy"
    arm.move_to_joints(cell.workspace.home + np.array([0, 0, -0.3, 0, 0, 0, 0]))
    with pytest.raises(ArmInView, match=r"joint 3 is 0.30 rad from home: .*--go-home\)") as caught:
        capture_at_home(cell)
    assert "\n" not in str(caught.value)


def test_nothing_between_the_pads_is_not_lifted(cell: Cell, arm: WritingArm):
    arm.between = 0.0
    result = execute_grasp(cell, GRASP)
    assert arm.log[-1] == ("grasp", 20.0)
    assert (result.lifted, result.holding, result.aborted) == (False, False, None)


LOAD = Load(mass=0.3, centre_tcp=np.array([0.0, 0.0, 0.01]), inertia=1e-4 * np.eye(3))


def test_a_known_part_is_told_between_closing_and_lift_until_the_fingers_open(cell: Cell, arm: WritingArm):
    execute_grasp(cell, GRASP, load=LOAD)
    assert arm.log[3:] == [("grasp", 20.0), ("load", 0.3), ("pose", [0.4, 0.1, 0.16]), ("wait", 0.2)]
    arm.log.clear()
    put_down(cell, GRASP)
    assert arm.log[1:] == [("gripper", 0.08), ("load", None), ("pose", [0.4, 0.1, 0.12])]
    arm.between = 0.0
    arm.log.clear()
    execute_grasp(cell, GRASP, load=LOAD)
    assert [verb for verb, _ in arm.log] == ["gripper", "pose", "pose", "grasp"]  # nothing to tell


def test_a_part_that_is_too_heavy_moves_nothing(cell: Cell, arm: WritingArm):
    with pytest.raises(LoadTooHeavy, match=r"weighs 2.500 kg, this arm carries 2.270 kg") as caught:
        execute_grasp(cell, GRASP, load=dataclasses.replace(LOAD, mass=2.5))
    assert arm.log == [] and "\n" not in str(caught.value)
    assert str(caught.value).endswith("this arm carries 2.270 kg: leave it out, or check its density")


@pytest.mark.parametrize(("width", "grasped", "holding"), [
    (0.03, None, True), (0.03, True, True), (0.03, False, False),
    (0.0008, True, False), (0.0008, None, False),
])  # fmt: skip
def test_what_is_held_after_the_lift_follows_the_rule_of_the_closing(
    cell: Cell, arm: WritingArm, monkeypatch, width: float, grasped: bool | None, holding: bool
):
    """The hand's own report counts, and pads nearer than the cell's closed_width hold nothing."""
    arm.limits = dataclasses.replace(arm.limits, closed_width=1e-3)
    state = ToyArm._state
    monkeypatch.setattr(arm, "_wait", lambda _: setattr(arm, "_width", width))
    monkeypatch.setattr(arm, "_state", lambda: dataclasses.replace(state(arm), grasped=grasped))
    assert execute_grasp(cell, GRASP).holding is holding


def test_a_hand_that_opens_less_far_opens_as_far_as_it_does(cell: Cell, arm: WritingArm, monkeypatch):
    state = ToyArm._state
    monkeypatch.setattr(arm, "_state", lambda: dataclasses.replace(state(arm), max_width=0.07))
    monkeypatch.setattr(arm, "_known_width", lambda: 0.07)
    execute_grasp(cell, GRASP)
    let_go(cell, GRASP, opening=0.075)
    assert [value for verb, value in arm.log if verb == "gripper"] == [0.07, 0.07]
    with pytest.raises(OutOfWorkspace, match=r"0 .. 0.0700 m, which homing found"):
        arm.move_gripper(0.08)


def test_a_hand_that_opens_farther_than_its_stroke_opens_all_the_way(
    cell: Cell, arm: WritingArm, monkeypatch: pytest.MonkeyPatch
):
    """Homing found 81.5 mm; no width over 80 mm may be asked for."""
    state = ToyArm._state
    monkeypatch.setattr(arm, "_state", lambda: dataclasses.replace(state(arm), max_width=0.0815))
    monkeypatch.setattr(arm, "_known_width", lambda: 0.0815)
    for width, opening in ((0.061, None), (0.0755, 0.0)):  # to 81 mm, and to 81.5 mm
        arm._width = width
        arm.log.clear()
        let_go(cell, GRASP, opening=opening)
        assert arm.log[0] == ("gripper", 0.0815)


def test_a_part_lost_on_the_way_up_was_lifted_and_is_not_held(cell: Cell, arm: WritingArm, monkeypatch):
    monkeypatch.setattr(arm, "_wait", lambda _: setattr(arm, "_width", 0.0004))
    result = execute_grasp(cell, GRASP)
    assert (result.lifted, result.holding) == (True, False) and result.width == 0.0004


@pytest.mark.parametrize("top", [0.15, 0.11, 0.05])
def test_a_grasp_whose_lift_approach_or_target_is_out_of_the_box_moves_nothing(
    cell: Cell, arm: WritingArm, top: float
):
    arm.limits = dataclasses.replace(arm.limits, box_upper=np.array([1.0, 1.0, top]))
    with pytest.raises(OutOfWorkspace, match="outside the workspace"):
        execute_grasp(cell, GRASP)
    assert arm.log == []
    arm.move_gripper(0.05)  # a refusal is no fault


def test_contact_is_a_result_after_which_the_arm_must_be_recovered(cell: Cell, arm: WritingArm):
    """The toy arm meets something below 5 cm."""
    result = execute_grasp(cell, Grasp.from_vector(np.array([0.4, 0.1, 0.03, 0.3])))
    assert result.aborted is not None and "contact force over 20 N" in result.aborted
    assert (result.lifted, result.holding) == (False, False)
    assert result.T_base_tcp.position == pytest.approx([0.4, 0.1, 0.12])  # where it stood before
    with pytest.raises(NeedsRecovery):
        arm.move_gripper(0.05)


def test_a_stop_is_raised_and_nothing_follows(cell: Cell, arm: WritingArm, monkeypatch):
    def stopped(force: float) -> GraspOutcome:
        arm.stop()
        return GraspOutcome(width=0.05, holding=False)

    monkeypatch.setattr(arm, "_grasp", stopped)
    with pytest.raises(Stopped):
        execute_grasp(cell, GRASP)
    assert arm.log[-1] == ("pose", [0.4, 0.1, 0.06])


def test_a_part_is_released_two_millimetres_up_and_the_hand_rises(cell: Cell, arm: WritingArm):
    execute_grasp(cell, GRASP)
    arm.log.clear()
    put_down(cell, GRASP)
    assert arm.log == [("pose", [0.4, 0.1, 0.062]), ("gripper", 0.08), ("pose", [0.4, 0.1, 0.12])]
    arm.log.clear()
    lower(cell, GRASP, height=0.01)
    assert arm.log == [("pose", [0.4, 0.1, 0.07])]


@pytest.mark.parametrize(
    ("width", "opening", "opened"),
    [
        (0.031, None, 0.051),
        (0.031, 0.06, 0.06),
        (0.031, 0.036, 0.037),
        (0.031, 0.0, 0.037),
        (0.07, None, 0.08),
        (0.079, 0.079, 0.08),
    ],
)
def test_fingers_open_by_two_centimetres_or_as_far_as_asked_and_no_farther_than_they_can(
    cell: Cell, arm: WritingArm, width: float, opening: float | None, opened: float
):
    arm.move_gripper(width)
    arm.log.clear()
    let_go(cell, GRASP, opening=opening)
    assert arm.log[0] == ("gripper", opened)


def test_on_its_way_home_the_hand_first_rises(cell: Cell, arm: WritingArm):
    home = cell.workspace.home.tolist()

    def steps(z: float) -> list[tuple[str, Any]]:
        arm.move_to_pose(Pose(position=np.array([0.5, 0.2, z]), quat_wxyz=GRASP.T_base_tcp.quat_wxyz))
        arm.log.clear()
        go_home(cell)
        return arm.log

    # To 12 cm over the table, or by 5 cm.
    assert steps(0.06) == [("gripper", 0.08), ("pose", [0.5, 0.2, 0.12]), ("joints", home)]
    assert steps(0.2) == [("gripper", 0.08), ("pose", [0.5, 0.2, 0.25]), ("joints", home)]
    # And no higher than the box.
    assert steps(0.98) == [("gripper", 0.08), ("pose", [0.5, 0.2, 1.0]), ("joints", home)]
    arm.log.clear()
    go_home(cell)
    assert arm.log == [("gripper", 0.08)]


@pytest.mark.parametrize(
    ("z", "tallest", "goes"),
    [(0.2, 0.1, True), (0.2, 0.1765, True), (0.2, 0.1785, False), (0.06, 0.0, False)],
)
def test_a_hand_that_cannot_rise_goes_home_if_it_is_above_all_else(
    cell: Cell, arm: WritingArm, monkeypatch, z: float, tallest: float, goes: bool
):
    """By a joint that is near its limit. The pads reach 9.5 mm below the TCP and pass 15 mm over things."""

    def refuse(T_base_tcp: Pose, *, speed: float = 0.25) -> None:
        raise OutOfWorkspace("no straight line")

    arm.move_to_pose(Pose(position=np.array([0.5, 0.2, z]), quat_wxyz=GRASP.T_base_tcp.quat_wxyz))
    arm.log.clear()
    monkeypatch.setattr(arm, "move_to_pose", refuse)
    if goes:  # 1 mm lower than it should be is as an arm arrives
        go_home(cell, tallest=tallest)
        assert arm.log == [("gripper", 0.08), ("joints", cell.workspace.home.tolist())]
    else:
        with pytest.raises(OutOfWorkspace, match="no straight line"):
            go_home(cell, tallest=tallest)
        assert arm.log == [("gripper", 0.08)]


def test_a_simulated_part_falls_where_the_hand_cannot_put_it_down_and_a_real_one_stays(
    cell: Cell, arm: WritingArm, monkeypatch
):
    move = arm.move_to_pose

    def no_way_down(T_base_tcp: Pose, *, speed: float = 0.25) -> None:
        if T_base_tcp.position[2] < 0.1:
            raise OutOfWorkspace("no straight line")
        move(T_base_tcp, speed=speed)

    execute_grasp(cell, GRASP)
    monkeypatch.setattr(arm, "move_to_pose", no_way_down)
    arm.log.clear()
    with pytest.raises(OutOfWorkspace, match="no straight line"):
        go_home(cell, take=lambda: False)
    assert arm.log == [] and arm.in_hand() is not None
    arm.simulated = True
    go_home(cell)
    assert arm.log[0] == ("gripper", 0.08) and arm.log[-1] == ("joints", cell.workspace.home.tolist())


def test_an_arm_that_was_guided_out_of_the_box_goes_home_without_rising_there(cell: Cell, arm: WritingArm):
    home = cell.workspace.home.tolist()
    arm._joints = np.array([0.4, 1.2, 0.3, 0, 0, 0, 0])  # y is 1 m at most
    go_home(cell)
    assert arm.log == [("gripper", 0.08), ("joints", home)]
    # From above it the hand comes down into the box first.
    arm._joints = np.array([0.4, 0.2, 1.3, 0, 0, 0, 0])
    arm.log.clear()
    go_home(cell)
    assert arm.log == [("gripper", 0.08), ("pose", [0.4, 0.2, 1.0]), ("joints", home)]


def test_nothing_moves_to_what_a_camera_sees_whose_pose_was_measured_by_hand(
    cell: Cell, arm: WritingArm, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(ToyCamera, "by_hand", True)
    with pytest.raises(NotCalibrated, match=r"by hand, .*: nothing moves .*hal.calibrate") as caught:
        execute_grasp(cell, GRASP)
    assert arm.log == [] and "\n" not in str(caught.value)
    go_home(cell)  # home does not depend on the camera


def test_what_the_hand_no_longer_reports_is_not_in_it(cell: Cell, arm: WritingArm, monkeypatch):
    """The rule of the closing holds on the way home, too: nothing is put down that is not there."""
    execute_grasp(cell, GRASP)
    assert arm.in_hand() is not None
    state = ToyArm._state
    monkeypatch.setattr(arm, "_state", lambda: dataclasses.replace(state(arm), grasped=False))
    assert arm.in_hand() is None
