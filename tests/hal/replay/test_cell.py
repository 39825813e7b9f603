"""A recorded run plays back as it was, and nothing but it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from hal import Cell, cell_from_yaml, execute_grasp, go_home
from hal.errors import HandFull, MissingRecording, NotCalibrated
from hal.replay import recorded_cell
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.grasp import Grasp
from tests.hal.replay.program import replayed, run_on
from tests.hal.replay.toy import ToyArm, ToyCamera, toy_cell


def test_the_same_program_gets_the_same_answers(recording: Path, tmp_path: Path):
    live: list[object] = []
    with recorded_cell(toy_cell(), tmp_path / "again.h5").connected() as cell:
        run_on(cell, live)
    cell = replayed(recording)
    for _ in range(2):  # it can be opened again and begins anew
        played: list[object] = []
        with cell.connected():
            run_on(cell, played)
        assert json.dumps(played) == json.dumps(live)  # NaN compares as text
    assert cell.workspace.region == (0.3, 0.6, -0.1, 0.1)
    assert cell.arm.limits.max_force == 70.0


def test_what_a_program_was_refused_it_is_refused_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A camera measured by hand, and a real hand that holds something."""
    grasp = Grasp(position=np.array([0.45, 0.0, 0.08]), theta=np.array(0.0))

    def refused(cell: Cell) -> type[Exception]:
        with cell.connected():
            cell.camera.capture()
            with pytest.raises((NotCalibrated, HandFull)) as caught:
                execute_grasp(cell, grasp)
                go_home(cell)
        return caught.type

    for name, device, attribute, value in (
        ("hand.h5", ToyArm, "simulated", False),
        ("camera.h5", ToyCamera, "by_hand", True),
    ):
        monkeypatch.setattr(device, attribute, value)
        live = refused(recorded_cell(toy_cell(), tmp_path / name))
        assert refused(replayed(tmp_path / name)) is live
        again = recorded_cell(replayed(tmp_path / name), tmp_path / f"again-{name}")
        assert refused(again) is live
        assert refused(replayed(tmp_path / f"again-{name}")) is live


def test_cell_files_of_recordings_are_checked(recording: Path, tmp_path: Path):
    def build(text: str) -> Cell:
        (tmp_path / "cell.yaml").write_text(text)
        return cell_from_yaml(tmp_path / "cell.yaml")

    assert build(f"type: replay\nrecording: {recording}").feeder is not None
    with pytest.raises(MissingRecording, match="there is no recording"):
        build("type: replay\nrecording: none.h5")
    with pytest.raises(BadConfig, match="unknown key 'loop'"):
        build(f"type: replay\nrecording: {recording}\nloop: true")
    with pytest.raises(BadConfig, match="is recorded itself"):
        build(f"type: recorded\ncell: {tmp_path / 'cell.yaml'}\nout: {tmp_path / 'x.h5'}")
