"""The simulated arm skips what need not be simulated, and nothing else changes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import sapien

import hal.sim.arm
from hal import Cell, execute_grasp, go_home, put_down
from hal.sim import SapienCellConfig, sapien_cell
from hal.sim.world import SapienWorld
from mskgrasp.core.geometry import pose_distance
from mskgrasp.core.grasp import Grasp
from tests.hal.watching import check_watching


@pytest.fixture(scope="module")
def cell() -> Iterator[Cell]:
    with sapien_cell(SapienCellConfig(type="sapien")).connected() as cell:
        yield cell


@pytest.mark.parametrize(("part", "offset"), [("hex_nut_m30", (0.004, 0.003)), ("hinge_60x30", (0.0, 0.004))])
def test_long_steps_leave_a_part_in_the_hand_and_on_the_table_as_short_ones_do(
    cell: Cell, monkeypatch, part: str, offset: tuple[float, float]
):
    assert isinstance(cell.feeder, SapienWorld) and cell.tracker is not None
    steps, hands, placed = [], [], []
    for far in (True, False):
        if not far:
            for gap in ("AIR_GAP", "PAD_GAP", "TABLE_GAP"):
                monkeypatch.setattr(hal.sim.arm, gap, np.inf)
        cell.feeder.present(part, 1)
        made = _count_steps(cell.feeder, monkeypatch)
        before = cell.tracker.part_pose().position
        grasp = Grasp.from_vector(np.array([before[0] + offset[0], before[1] + offset[1], 0.0115, 0.3]))
        result = execute_grasp(cell, grasp)
        assert result.holding
        hands.append(result.T_base_tcp.inverse() @ cell.tracker.part_pose())
        put_down(cell, grasp, opening=0.0)
        placed.append(cell.tracker.part_pose())
        steps.append(len(made))
        go_home(cell)
    assert steps[0] < 0.7 * steps[1]
    for coarse, fine in (hands, placed):
        moved, turned = pose_distance(coarse, fine)
        assert moved < 0.2e-3 and np.degrees(turned) < 0.3


def test_a_part_that_still_falls_is_simulated_finely(cell: Cell, monkeypatch):
    assert isinstance(cell.feeder, SapienWorld)
    cell.feeder.present("hex_nut_m30", 1)
    made = _count_steps(cell.feeder, monkeypatch)
    cell.arm.wait(0.1)
    assert set(made) == {hal.sim.arm.AIR_HZ}
    pose = cell.feeder.env.part.pose.sp
    cell.feeder.env.part.set_pose(sapien.Pose(pose.p + [0.0, 0.0, 0.02], pose.q))
    cell.feeder.env.motion.step()
    assert not cell.feeder.at_rest()
    made.clear()
    cell.arm.wait(0.1)
    assert set(made) == {cell.feeder.physics.rate_hz}
    assert cell.feeder.at_rest()


def _count_steps(world: SapienWorld, monkeypatch) -> list[int]:
    """A list that gets the rate of each further step of the present simulation."""
    made: list[int] = []
    step = world.env.motion.step

    def counted(n_steps: int = 1) -> None:
        made.extend([world.env.motion.rate_hz] * n_steps)
        step(n_steps)

    monkeypatch.setattr(world.env.motion, "step", counted)
    return made


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
