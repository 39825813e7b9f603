"""A program that departs from the recording is stopped where it does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hal import execute_grasp
from hal.errors import NeedsRecovery, NotRecorded, OutOfWorkspace
from hal.replay import recorded_cell
from mskgrasp.core.grasp import Grasp
from tests.hal.replay.program import GRASP, at, replayed
from tests.hal.replay.toy import toy_cell


def test_another_command_is_refused_names_both_and_nothing_follows_before_recover(recording: Path):
    with replayed(recording).connected() as cell:
        assert cell.feeder is not None
        with pytest.raises(
            NotRecorded, match=r"was present\(part nut, seed 3\).*present\(part nut, seed 4\)"
        ):
            cell.feeder.present("nut", 4)
        cell.feeder.present("nut", 3)
        cell.camera.capture()
        with pytest.raises(NotRecorded, match=r"was open_gripper\(\).*grasp\(force 20.0\)"):
            cell.arm.grasp(20.0)
        with pytest.raises(NeedsRecovery, match=r"recover\(\)"):
            cell.arm.open_gripper()
        cell.arm.recover()
        cell.arm.open_gripper()


def test_commands_may_differ_by_the_tolerances_and_no_more(recording: Path):
    with replayed(recording).connected() as cell:
        assert cell.feeder is not None
        cell.feeder.present("nut", 3)
        cell.camera.capture()
        execute_grasp(cell, Grasp.from_vector(GRASP + np.array([5e-4, 0, 0, 5e-3])))
    with replayed(recording).connected() as cell:
        assert cell.feeder is not None
        cell.feeder.present("nut", 3)
        cell.camera.capture()
        with pytest.raises(NotRecorded):
            execute_grasp(cell, Grasp.from_vector(GRASP + np.array([2e-3, 0, 0, 0])))


def test_a_question_gets_the_answer_to_the_nearest_one(tmp_path: Path):
    within, beyond = (
        at(0.5, x=0.9998),
        at(0.5, x=1.0003),
    )  # the box ends at 1 m
    with recorded_cell(toy_cell(), tmp_path / "run.h5").connected() as cell:
        with pytest.raises(OutOfWorkspace):
            cell.arm.check_pose(beyond)
        cell.arm.check_pose(within)
    with replayed(tmp_path / "run.h5").connected() as cell:
        cell.arm.check_pose(within)
        with pytest.raises(OutOfWorkspace):
            cell.arm.check_pose(beyond)
        with pytest.raises(NotRecorded):
            cell.arm.check_pose(at(0.5, x=0.99))
        with pytest.raises(NotRecorded, match="ask the cell itself"):
            cell.arm.check_joints(cell.workspace.home)


def test_a_frame_comes_where_it_was_taken(recording: Path):
    with replayed(recording).connected() as cell, pytest.raises(NotRecorded, match="asks for capture"):
        cell.camera.capture()
