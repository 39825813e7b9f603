"""The doctor on whole cell files."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from hal.doctor.checks import Finding
from hal.doctor.config import DoctorConfig
from hal.doctor.run import examine, next_step
from mskgrasp.core.errors import BadConfig
from tests.hal.franka.robots import fci5, write_cell


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
