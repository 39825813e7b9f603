"""The doctor on whole cell files."""

from __future__ import annotations

import io
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import yaml

from hal.doctor import run
from hal.doctor.checks import Finding
from hal.doctor.config import DoctorConfig
from hal.doctor.run import examine, next_step
from hal.mujoco.arm import MujocoArm
from hal.operator import Operator
from mskgrasp.core.errors import BadConfig
from tests.hal.franka.robots import fci5, write_cell
from tests.hal.touch.tables import CELLS, simulated_file


def test_an_arms_driver_in_the_place_of_a_camera_is_a_finding(tmp_path: Path):
    path = tmp_path / "cell.yaml"
    path.write_text("type: devices\ncamera: {driver: franky}\nworkspace: {table_z: 0.0}\n")
    assert [f.level for f in examine(path, move=False) if f.subject == "cell file"] == ["fail"]


def test_a_cell_without_its_devices_says_what_is_missing_and_goes_on(tmp_path: Path):
    """No robot at that address, no Kinect, no calibration: each a line, none an exception."""
    cell = dict(
        type="devices",
        arm=dict(driver="panda_py", host="127.0.0.1", connect_timeout_s=30.0),
        camera=dict(driver="kinect2", calibration="camera.yaml"),
        workspace=dict(table_z=0.0),
    )
    path = tmp_path / "cell.yaml"
    path.write_text(yaml.safe_dump(cell))
    findings = {finding.subject: finding for finding in examine(path, move=True)}
    assert findings["workspace"].level == findings["cell file"].level == "ok"
    for subject in ("driver kinect2", "calibration", "camera", "arm", "motion"):
        assert findings[subject].level == "fail", findings[subject]
    assert all("\n" not in finding.text for finding in findings.values())


@pytest.fixture
def moves(monkeypatch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """Joints to which the arm of a simulated cell, here taken for a real one, is sent."""
    sent: list[np.ndarray] = []
    move = MujocoArm.move_to_joints
    monkeypatch.setattr(MujocoArm, "simulated", False)
    monkeypatch.setattr(
        MujocoArm, "move_to_joints", lambda arm, to, **how: sent.append(to) or move(arm, to, **how)
    )
    return sent


def operator_answers(monkeypatch: pytest.MonkeyPatch, answers: str) -> io.StringIO:
    """The operator of a real arm answers this; what they are asked."""
    asked = io.StringIO()
    monkeypatch.setattr(run, "Operator", partial(Operator, answers=io.StringIO(answers), prompts=asked))
    return asked


def test_after_a_failed_check_nothing_moves_and_nothing_is_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moves: list[np.ndarray]
):
    """The table stands 5 mm higher than the file says."""
    asked = operator_answers(monkeypatch, "")
    found = list(examine(simulated_file(tmp_path, "mujoco", height=0.005), move=True, dry_run=True))
    assert [finding.subject for finding in found if finding.level == "fail"] == ["table", "motion"]
    assert found[-1].text == "not checked: repair what failed first"
    assert moves == [] and asked.getvalue() == ""


def test_an_operator_is_asked_once_before_a_real_arm_moves(
    monkeypatch: pytest.MonkeyPatch, moves: list[np.ndarray]
):
    asked = operator_answers(monkeypatch, "n\n")
    *_, last = examine(CELLS / "mujoco.yaml", move=True, dry_run=True)
    assert (last.level, last.subject) == ("fail", "motion") and "the operator said no" in last.text
    assert moves == [] and asked.getvalue().count("May the arm move?") == 1
    asked = operator_answers(monkeypatch, "y\n")
    found = {finding.subject: finding.level for finding in examine(CELLS / "mujoco.yaml", move=True)}
    assert found["joint motion"] == found["gripper"] == "ok" and len(moves) == 2
    assert asked.getvalue().count("May the arm move?") == 1


def test_a_real_arm_does_not_move_where_no_operator_can_be_asked(
    monkeypatch: pytest.MonkeyPatch, moves: list[np.ndarray]
):
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n"))
    *_, last = examine(CELLS / "mujoco.yaml", move=True)
    assert (last.level, last.subject) == ("fail", "motion") and moves == []
    assert "standard input is no terminal" in last.text and "\n" not in last.text


def test_a_wrong_cell_file_is_a_finding_and_a_missing_one_an_error(tmp_path: Path):
    (tmp_path / "cell.yaml").write_text("type: devices\narms: {}")
    assert [f.level for f in examine(tmp_path / "cell.yaml", move=False) if f.subject == "cell file"] == [
        "fail"
    ]
    with pytest.raises(BadConfig, match="No such file"):
        list(examine(tmp_path / "none.yaml", move=False))


@pytest.mark.slow
def test_a_hand_that_desk_does_not_know_is_found_over_the_wire(tmp_path: Path):
    with fci5() as robot:
        path = write_cell(tmp_path, "panda_py", robot.host, contact_force=15.0)
        for order, level, words in (
            ("hand 0.73", "ok", "Desk states 0.73 kg, centre at [-0.01, 0.0, 0.03] m"),
            ("hand 0.0", "fail", "Desk states 0.00 kg"),
        ):
            robot.order(order)
            findings = {finding.subject: finding for finding in examine(path, move=False)}
            assert findings["hand"].level == level and words in findings["hand"].text
        assert "parts up to 1.22 kg" in findings["payload"].text
        assert findings["grip"].level == "warn" and "load" not in findings


def test_the_last_line_says_what_to_do_next():
    cell = Path("cell.yaml")
    ok, poor, bad = (Finding(level=level, subject=level, text="") for level in ("ok", "warn", "fail"))
    still, moved, dry = (
        DoctorConfig(cell=cell, move=move, dry_run=dry)
        for move, dry in ((False, False), (True, False), (True, True))
    )
    assert next_step([ok, bad, Finding(level="fail", subject="later", text="")], dry).endswith("first: fail")
    assert "hal.doctor --cell cell.yaml --move:" in next_step([ok], still)
    assert "hal.doctor --cell cell.yaml --dry-run:" in next_step([ok], moved)
    assert next_step([ok], dry) == "ready for the first grasp"
    assert next_step([ok, poor, poor], dry) == "ready for the first grasp (see the warnings: warn)"
