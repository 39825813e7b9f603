"""Wrong input to the programs: one line, the remedy, exit code 2 or 1."""

from __future__ import annotations

from pathlib import Path

import pytest

from hal.calibrate import run as calibrate
from hal.doctor import run as doctor
from hal.replay import recorded_cell
from tests.hal.real_cell import measured_cell
from tests.hal.replay.toy import toy_cell
from tests.programs import run_here

CELLS = Path(__file__).parents[3] / "configs" / "cells"


@pytest.mark.parametrize(
    ("program", "arguments", "message"),
    [
        (calibrate, [], "give --cell FILE"),
        (calibrate, ["--cell", "none.yaml"], "No such file"),
        (calibrate, ["--from", "nowhere"], "holds no pictures"),
        (calibrate, ["--print-board", "board.doc"], "must end in .pdf or .png"),
        (calibrate, ["--poses", "3"], "greater than or equal to 8"),
        (calibrate, ["--board.marker", "0.05", "--print-board", "b.pdf"], "0.4 to 0.9 times the square"),
        (calibrate, ["--board.columns", "12", "--board.rows", "12"], "columns * rows"),
        (calibrate, ["--cell", str(CELLS / "panda_kinect2.yaml")], "--camera-at X Y Z"),
        (
            calibrate,
            ["--cell", str(CELLS / "sapien.yaml"), "--camera-at", "0", "0", "1"],
            "knows where it is",
        ),
        (
            calibrate,
            ["--cell", "empty.yaml", "--camera-at", "0", "0", "1"],
            "'type' is missing; legal: sapien",
        ),
        (
            calibrate,
            ["--cell", str(CELLS / "mujoco.yaml")],
            "nothing draws a board in this simulated cell; type: sapien",
        ),
        (calibrate, ["--cell", "null.yaml"], "'calibration': input is not a valid path"),
        (doctor, ["--cell", "null.yaml", "--gripper"], "'calibration': input is not a valid path"),
        (calibrate, ["--cell", "."], "Is a directory"),
        (calibrate, ["--camera-towards", "0.5", "0", "0"], "give camera_at, too"),
        (doctor, ["--cell", "none.yaml"], "No such file"),
        (doctor, ["--cell", "."], "Is a directory"),
    ],
)
def test_wrong_input_is_one_line_and_exit_code_2(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, program, arguments: list[str], message: str
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.yaml").touch()
    measured_cell(tmp_path).rename(tmp_path / "null.yaml")
    text = (tmp_path / "null.yaml").read_text()
    (tmp_path / "null.yaml").write_text(text.replace("calibration: kinect2.yaml", "calibration: null"))
    done = run_here(program.main, *arguments)
    assert done.returncode == 2 and message in done.stderr
    assert done.stderr.startswith("program: ") and done.stderr.count("\n") == 1


def test_a_recording_is_not_calibrated(tmp_path: Path):
    with recorded_cell(toy_cell(), tmp_path / "toy.h5").connected() as cell:
        cell.camera.capture()
    cell_file = tmp_path / "cell.yaml"
    cell_file.write_text(f"type: replay\nrecording: {tmp_path / 'toy.h5'}\n")
    done = run_here(calibrate.main, "--cell", str(cell_file), "--out", str(tmp_path / "out"))
    assert done.returncode == 2 and "a recording cannot be calibrated; solve the pictures" in done.stderr
