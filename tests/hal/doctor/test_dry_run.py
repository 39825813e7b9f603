"""A grasp of nothing: at a tenth of the speed, back home, and suspicious of a hand that holds nothing."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hal import Cell, open_cell
from hal.doctor import dry_run
from hal.doctor.dry_run import check_dry_run, slowed
from hal.errors import OutOfWorkspace
from mskgrasp.core.shipped import config_file


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


def test_what_stops_the_arm_is_the_finding(cell: Cell, monkeypatch):
    def refused(*_: object):
        raise OutOfWorkspace("a post is in the way")

    monkeypatch.setattr(dry_run, "execute_grasp", refused)
    (finding,) = check_dry_run(cell)
    assert finding.level == "fail" and finding.text == "a post is in the way"


def test_the_speeds_of_the_file_are_divided_by_ten_and_the_file_is_left_alone():
    values = {"arm": {"max_speed": 0.1, "max_joint_speed": 0.15, "host": "h"}, "type": "devices"}
    slow = slowed(values)["arm"]
    assert slow == {"max_speed": pytest.approx(0.01), "max_joint_speed": pytest.approx(0.015), "host": "h"}
    assert values["arm"]["max_speed"] == 0.1
    assert slowed({"type": "sapien"}) == {"type": "sapien"}


@pytest.mark.parametrize("driver", ["panda_py", "franky"])
def test_speeds_that_the_file_leaves_out_are_a_tenth_of_the_defaults(driver):
    slow = slowed({"type": "devices", "arm": {"driver": driver, "host": "h"}})["arm"]
    assert slow["max_speed"] == pytest.approx(0.01) and slow["max_joint_speed"] == pytest.approx(0.015)
