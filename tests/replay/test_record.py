"""The program hal.record, over a recording of a toy cell: no simulator, no hardware."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from hal.replay import read_recording, recorded_cell
from tests.replay.toy import toy_cell


@pytest.fixture
def cell_file(tmp_path: Path) -> Path:
    """A cell file whose camera and arm answer without anything behind them."""
    with recorded_cell(toy_cell(), tmp_path / "toy.h5").connected() as cell:
        for _ in range(3):
            cell.arm.state()
            cell.camera.capture()
    path = tmp_path / "cell.yaml"
    path.write_text(f"type: replay\nrecording: {tmp_path / 'toy.h5'}\n")
    return path


def record(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "hal.record", *arguments], capture_output=True, text=True)


def test_frames_of_any_cell_are_written_with_the_arms_state(cell_file: Path, tmp_path: Path):
    out = tmp_path / "new" / "frames.h5"
    done = record("--cell", str(cell_file), "--out", str(out), "--frames", "3", "--interval", "0")
    assert done.returncode == 0, done.stderr
    assert f"wrote {out}: 3 frames, 0 commands to the arm, 6 calls in all" in done.stdout
    assert [event.call for event in read_recording(out).events] == ["state", "capture"] * 3


def test_a_program_runs_on_the_recorded_cell_and_its_faults_are_kept(cell_file: Path, tmp_path: Path):
    out = tmp_path / "run.h5"
    done = record(
        "--cell", str(cell_file), "--out", str(out), "--run",
        f"hal.record --out {tmp_path / 'inner.h5'} --frames 4 --interval 0",
    )  # fmt: skip
    assert done.returncode == 1 and "ends after 3 commands; the program asks for capture()" in done.stderr
    recording = read_recording(out)
    assert recording.n_frames == 3
    assert recording.events[-1].error is not None and recording.events[-1].error[0] == "NotRecorded"


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--frames", "0"], 2, "greater than or equal to 1"),
        (["--run", "rm -r x"], 2, "begin with a program of this project"),
        (["--run", "mskgrasp.plan --cell a.yaml"], 2, "leave --cell away"),
        (["--cell", "none.yaml"], 2, "none.yaml"),
        (["--out", "{cell}"], 2, "exists already"),
        (["--out", "/proc/x.h5"], 2, "choose another file"),
    ],
)
def test_wrong_input_is_one_line(
    cell_file: Path, tmp_path: Path, arguments: list[str], code: int, message: str
):
    given = {"--cell": str(cell_file), "--out": str(tmp_path / "out.h5"), "--interval": "0"}
    given |= dict(zip(arguments[::2], (a.format(cell=cell_file) for a in arguments[1::2]), strict=True))
    done = record(*(word for pair in given.items() for word in pair))
    assert done.returncode == code, done.stderr
    assert message in done.stderr and len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out.h5").exists()
