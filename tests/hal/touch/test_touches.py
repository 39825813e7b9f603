"""Touches of tables that are known."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hal.errors import CommunicationLost, NeedsRecovery
from hal.touch.touches import PART_ROOM, TableNotFound, touch_points, touch_table
from mskgrasp.core.grasp import PAD_REACH
from tests.hal.touch.tables import REGION, FeelingArm, feeling_cell, tilted


def touches(height: Callable[[np.ndarray], float], **settings: Any) -> np.ndarray:
    cell = feeling_cell(height, **settings)
    with cell.arm:
        return touch_table(cell, search=0.03, force=5.0, speed=0.01)


def test_an_empty_region_is_touched_at_its_corners_and_in_the_middle():
    points = touch_points(REGION, None)
    expected = {(0.38, -0.12), (0.62, -0.12), (0.62, 0.12), (0.38, 0.12), (0.5, 0.0)}
    assert {(round(x, 9), round(y, 9)) for x, y in points} == expected


@pytest.mark.parametrize("part", [(0.5, 0.0), (0.38, -0.12), (0.6, 0.1), (0.44, -0.06), (0.5, 0.11)])
def test_no_touch_is_near_a_part_and_the_points_still_span_the_region(part: tuple[float, float]):
    points = touch_points(REGION, np.array(part))
    assert np.linalg.norm(points - part, axis=1).min() >= PART_ROOM
    assert np.ptp(points, axis=0) == pytest.approx([0.24, 0.24]) and len(np.unique(points, axis=0)) == 5


@pytest.mark.parametrize("table_z", [0.0, 0.1, -0.05])
@pytest.mark.parametrize("off", [0.0, 0.028, -0.028])
def test_a_table_anywhere_within_the_search_is_touched_where_it_is(table_z: float, off: float):
    height = tilted(table_z + off, (0.008, -0.004) if off == 0 else (0.0, 0.0))
    points = touches(height, table_z=table_z)
    assert points[:, 2] == pytest.approx([height(point[:2]) for point in points], abs=1e-9)


@pytest.mark.parametrize("pad_reach", [0.005, 0.02])
def test_pads_of_any_length_find_the_table_where_it_is(pad_reach: float):
    height = tilted(0.012, (0.004, 0.0))
    points = touches(height, pad_reach=pad_reach)
    assert points[:, 2] == pytest.approx([height(point[:2]) for point in points], abs=1e-9)


@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.02, -0.02)])
@pytest.mark.parametrize("off", [0.0, -0.028])
def test_a_table_is_touched_whatever_clearance_and_slope_the_file_states(
    slope: tuple[float, float], off: float
):
    points = touches(tilted(off, (0.0, 0.0)), table_slope=slope, clearance=0.05)
    assert points[:, 2] == pytest.approx(np.full(5, off), abs=1e-9)


def test_the_first_contact_is_made_twice_as_fast_and_none_with_another_force():
    cell = feeling_cell(tilted(0.0, (0.0, 0.0)))
    assert isinstance(cell.arm, FeelingArm)
    with cell.arm:
        touch_table(cell, search=0.03, force=4.0, speed=0.01)
        assert cell.arm.speeds == [0.02] + 5 * [0.01] and cell.arm.forces == 6 * [4.0]
        assert cell.arm.state().joints == pytest.approx(cell.workspace.home)


STATED = "30 mm of the height 0.0000 m"
NOT_FOUND = pytest.mark.parametrize(
    ("height", "message", "remedy"),
    [
        (lambda xy: -0.2, f"met no table at .*{STATED}", "--table-at Z"),
        (lambda xy: 0.06, f"met something at .* 0.0600 m high.*{STATED}", "--table-at Z"),
        (
            lambda xy: -0.2 if xy[0] > 0.5 else 0.0,
            r"met no table at \(0.620, -0.120\) m within 15 mm under the first contact, which was 0.0000 m",
            "keep workspace.region on the table",
        ),
        (
            lambda xy: 0.035 if xy[0] > 0.5 else 0.02,
            r"met something at \(0.620, -0.120\) m, 0.0350 m high, 15.0 mm over the first",
            "clear the region",
        ),
    ],
    ids=["too low", "too high", "ends", "covered"],
)
"""Heights at points (2,) of what the fingers meet, where a table is stated at 0."""


@NOT_FOUND
def test_a_table_that_is_not_found_is_one_line_with_the_remedy(
    height: Callable[[np.ndarray], float], message: str, remedy: str
):
    with pytest.raises(TableNotFound, match=message) as caught:
        touches(height)
    assert remedy in str(caught.value) and "\n" not in str(caught.value)


@NOT_FOUND
def test_the_closed_hand_rises_straight_from_where_it_found_no_table(
    height: Callable[[np.ndarray], float], message: str, remedy: str
):
    cell = feeling_cell(height)
    with cell.arm:
        with pytest.raises(TableNotFound):
            touch_table(cell, search=0.03, force=5.0, speed=0.01)
        state = cell.arm.state()
    x = 0.62 if height(np.array([0.62, 0.0])) != height(np.array([0.38, 0.0])) else 0.38
    assert state.T_base_tcp.position == pytest.approx([x, -0.12, 0.12 + PAD_REACH])
    assert state.gripper_width == 0.0


def test_a_hand_that_cannot_rise_says_why_and_keeps_the_first_fault(monkeypatch: pytest.MonkeyPatch):
    cell = feeling_cell(lambda xy: -0.2)
    assert isinstance(cell.arm, FeelingArm)
    search = cell.arm._move_until_contact

    def lose_afterwards(*how: Any) -> None:
        search(*how)
        monkeypatch.setattr(cell.arm, "_move_to_pose", lose)

    def lose(*_: object) -> None:
        raise CommunicationLost("the cable was pulled")

    monkeypatch.setattr(cell.arm, "_move_until_contact", lose_afterwards)
    with cell.arm, pytest.raises(CommunicationLost, match="the cable was pulled") as caught:
        touch_table(cell, search=0.03, force=5.0, speed=0.01)
    assert isinstance(caught.value.__cause__, TableNotFound)


def test_an_arm_that_is_lost_in_the_middle_is_stopped(monkeypatch: pytest.MonkeyPatch):
    cell = feeling_cell(tilted(0.0, (0.0, 0.0)))

    def lose(number: int, point: np.ndarray) -> None:
        if number == 1:
            monkeypatch.setattr(cell.arm, "_move_until_contact", die)

    def die(*_: object) -> None:
        raise CommunicationLost("the driver's process was ended by SIGKILL; open the cell again")

    with cell.arm:
        with pytest.raises(CommunicationLost):
            touch_table(cell, search=0.03, force=5.0, speed=0.01, touched=lose)
        with pytest.raises(NeedsRecovery):
            cell.arm.move_gripper(0.05)
