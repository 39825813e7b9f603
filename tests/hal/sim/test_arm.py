"""The simulated arm skips what need not be simulated, and nothing else changes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import hal.sim.arm
from hal import Cell, execute_grasp, go_home
from hal.sim import SapienCellConfig, sapien_cell
from mskgrasp.core.geometry import pose_distance
from mskgrasp.core.grasp import Grasp
from tests.hal.watching import check_watching


@pytest.fixture(scope="module")
def cell() -> Iterator[Cell]:
    with sapien_cell(SapienCellConfig(type="sapien")).connected() as cell:
        yield cell


@pytest.mark.parametrize(("part", "offset"), [("hex_nut_m30", (0.004, 0.003)), ("hinge_60x30", (0.0, 0.004))])
def test_long_steps_in_free_air_leave_a_part_in_the_hand_as_short_ones_do(
    cell: Cell, monkeypatch, part: str, offset: tuple[float, float]
):
    assert cell.feeder is not None and cell.tracker is not None
    hands = []
    for gap in (hal.sim.arm.AIR_GAP, np.inf):
        monkeypatch.setattr(hal.sim.arm, "AIR_GAP", gap)
        monkeypatch.setattr(hal.sim.arm, "PAD_GAP", 0.004 if np.isfinite(gap) else np.inf)
        cell.feeder.present(part, 1)
        before = cell.tracker.part_pose().position
        result = execute_grasp(
            cell, Grasp.from_vector(np.array([before[0] + offset[0], before[1] + offset[1], 0.0115, 0.3]))
        )
        hands.append((result.holding, result.T_base_tcp.inverse() @ cell.tracker.part_pose()))
        cell.arm.move_gripper(0.08)
        go_home(cell)
    (held, coarse), (held_finely, fine) = hands
    assert held == held_finely
    moved, turned = pose_distance(coarse, fine)
    assert moved < 0.2e-3 and np.degrees(turned) < 0.3


def test_a_second_grasp_presses_harder_and_does_not_drop_the_part(cell: Cell):
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("hex_nut_m30", 1)
    x, y, _ = cell.tracker.part_pose().position
    first = execute_grasp(cell, Grasp.from_vector(np.array([x, y, 0.0115, 0.3])))
    aloft = cell.tracker.part_pose()
    again = cell.arm.grasp(45.0)
    assert first.holding and again.holding and again.width == pytest.approx(first.width, abs=2e-4)
    moved, turned = pose_distance(aloft, cell.tracker.part_pose())
    assert moved < 0.2e-3 and np.degrees(turned) < 0.3
    cell.arm.move_gripper(0.08)
    go_home(cell)


def test_who_watches_a_motion_sees_the_arm_on_its_way_and_nothing_afterwards(cell: Cell):
    check_watching(cell)
