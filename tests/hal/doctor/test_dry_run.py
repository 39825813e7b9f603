"""A grasp of nothing: at a tenth of the speed, back home, and suspicious of a hand that holds nothing."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from hal import Cell, open_cell
from hal.doctor import dry_run
from hal.doctor.dry_run import PACE, check_dry_run
from hal.doctor.run import examine
from hal.errors import MotionAborted, NotConnected, OutOfWorkspace
from hal.franka import FrankaArm
from mskgrasp.core.shipped import config_file
from tests.hal.real_cell import measured_cell
from tests.hal.replay.toy import toy_cell


@pytest.fixture(scope="module")
def cell():
    with open_cell(config_file("cells/sapien.yaml")) as cell:
        yield cell


def test_the_whole_way_of_a_grasp_is_gone_over_the_table_and_back(cell: Cell, monkeypatch):
    planned = []
    grasp = dry_run.execute_grasp
    monkeypatch.setattr(dry_run, "execute_grasp", lambda *given: planned.append(given[1]) or grasp(*given))
    (finding,) = check_dry_run(cell)
    assert finding.level == "ok" and "nothing held" in finding.text
    lowest = float(cell.workspace.lowest_grasp_z(cell.workspace.centre))
    assert [one.position[2] for one in planned] == [pytest.approx(lowest + 0.05)]
    assert np.abs(cell.arm.state().joints - cell.workspace.home).max() < 0.01


def test_a_hand_that_holds_nothing_and_says_otherwise_is_found(cell: Cell, monkeypatch):
    grasp = dry_run.execute_grasp
    monkeypatch.setattr(
        dry_run, "execute_grasp", lambda *given: dataclasses.replace(grasp(*given), holding=True)
    )
    (finding,) = check_dry_run(cell)
    assert finding.level == "fail" and "closed_width" in finding.text


def test_a_real_arm_that_believes_it_holds_something_opens_its_fingers_and_goes_home():
    """The toy arm is no simulated one, and its hand always reports a part."""
    cell = toy_cell()
    with cell.arm as arm:
        (finding,) = check_dry_run(cell)
        assert finding.level == "fail" and "closed_width" in finding.text
        state = arm.state()
        assert state.joints == pytest.approx(cell.workspace.home) and state.gripper_width == 0.08


def test_an_arm_that_met_something_stays_there_and_the_reason_is_the_finding(monkeypatch):
    cell = toy_cell()

    def met(force: float) -> None:
        raise MotionAborted("contact force over 20 N: the arm stopped")

    monkeypatch.setattr(cell.arm, "_grasp", met)
    with cell.arm as arm:
        (finding,) = check_dry_run(cell)
        assert finding.level == "fail" and finding.text == "contact force over 20 N: the arm stopped"
        assert arm.state().T_base_tcp.position[:2] == pytest.approx(cell.workspace.centre)


def test_what_stops_the_arm_is_the_finding(cell: Cell, monkeypatch):
    def refused(*_: object):
        raise OutOfWorkspace("a post is in the way")

    monkeypatch.setattr(dry_run, "execute_grasp", refused)
    (finding,) = check_dry_run(cell)
    assert finding.level == "fail" and finding.text == "a post is in the way"


def test_a_real_arm_is_slowed_before_it_is_connected_also_where_it_is_recorded(tmp_path: Path, monkeypatch):
    real, recorded = measured_cell(tmp_path), tmp_path / "recorded.yaml"
    recorded.write_text(f"{{type: recorded, cell: {real}, out: {tmp_path / 'run.h5'}}}")
    done: list[object] = []

    def refused(_: object):
        done.append("connected")
        raise NotConnected("no robot here")

    monkeypatch.setattr(FrankaArm, "slow_down", lambda _, pace: done.append(pace))
    monkeypatch.setattr(FrankaArm, "connect", refused)
    for path in (real, recorded):
        for dry in (True, False):
            done.clear()
            list(examine(path, move=False, dry_run=dry))
            assert done[0] == (PACE if dry else "connected"), path
