"""The program hal.record, over a recording of a toy cell: no simulator, no hardware."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import pytest

from hal.record.run import main
from hal.replay import read_recording, recorded_cell
from tests.hal.replay.toy import toy_cell
from tests.programs import Ended, run_here, running

TIMEOUT_S = 120.0


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


def record(*arguments: str) -> Ended:
    return run_here(main, *arguments)


def test_frames_of_any_cell_are_written_with_the_arms_state(cell_file: Path, tmp_path: Path):
    out = tmp_path / "new" / "frames.h5"
    done = record("--cell", str(cell_file), "--out", str(out), "--frames", "3", "--interval", "0")
    assert done.returncode == 0, done.stderr
    assert f"wrote {out}: 3 frames, 0 commands to the arm, 6 calls in all" in done.stdout
    assert [event.call for event in read_recording(out).events] == ["state", "capture"] * 3


def test_a_program_runs_on_the_recorded_cell_and_its_faults_are_kept(cell_file: Path, tmp_path: Path):
    out = tmp_path / "run.h5"
    inner = f"hal.record --out {tmp_path / 'inner.h5'} --frames 4 --interval 0"
    with running("hal.record", "--cell", str(cell_file), "--out", str(out), "--run", inner) as program:
        _, printed = program.communicate(timeout=TIMEOUT_S)
    assert program.returncode == 1 and "ends after 3 commands; the program asks for capture()" in printed
    recording = read_recording(out)
    assert recording.n_frames == 3
    assert recording.events[-1].error is not None and recording.events[-1].error[0] == "NotRecorded"


def test_a_program_may_be_named_as_on_the_command_line(
    cell_file: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
):
    done = record(
        "--cell", str(cell_file), "--out", str(tmp_path / "run.h5"), "--run", "mskgrasp plan --no-such"
    )
    assert done.returncode == 2 and "mskgrasp.plan: unknown option --no-such" in capfd.readouterr().err


def test_ctrl_c_keeps_the_frames(cell_file: Path, tmp_path: Path):
    out = tmp_path / "frames.h5"
    arguments = ["--cell", str(cell_file), "--out", str(out), "--interval", "3600"]
    with running("hal.record", *arguments) as program:
        wait_for_frame(tmp_path / "frames.h5.part")
        program.send_signal(signal.SIGINT)
        _, printed = program.communicate(timeout=TIMEOUT_S)
    assert program.returncode == 130 and "Ctrl-C" in printed and "Traceback" not in printed
    assert read_recording(out).n_frames == 1


@pytest.mark.slow
def test_ctrl_c_in_a_terminal_reaches_the_program_once(cell_file: Path, tmp_path: Path):
    out, inner = tmp_path / "run.h5", tmp_path / "inner.h5"
    run = f"hal.record --out {inner} --interval 3600"
    program = [sys.executable, "-m", "hal.record", "--cell", str(cell_file), "--out", str(out), "--run", run]
    keyboard, terminal = os.openpty()
    with (
        open(keyboard, "wb", buffering=0) as keys,
        subprocess.Popen(
            ["setsid", "--ctty", "--wait", *program], stdin=terminal, stdout=terminal, stderr=terminal
        ) as ran,
    ):
        os.close(terminal)
        wait_for_frame(tmp_path / "inner.h5.part")
        keys.write(b"\x03")
        assert ran.wait(timeout=TIMEOUT_S) == 130
    assert read_recording(out).n_frames == read_recording(inner).n_frames == 1


def test_a_terminal_sends_ctrl_c_to_what_runs_in_its_foreground():
    ask = [sys.executable, "-c", "from hal.record.run import _in_foreground as it; exit(7 if it() else 3)"]
    keyboard, terminal = os.openpty()
    try:
        assert (
            subprocess.run(["setsid", "--ctty", "--wait", *ask], stdin=terminal, check=False).returncode == 7
        )
        assert subprocess.run(["setsid", "--wait", *ask], stdin=terminal, check=False).returncode == 3
    finally:
        os.close(keyboard)
        os.close(terminal)


@pytest.mark.slow
def test_a_program_that_did_not_hear_ctrl_c_is_reported(cell_file: Path, tmp_path: Path):
    """A terminal sends Ctrl-C to both, `kill` to one alone."""
    out, inner = tmp_path / "run.h5", tmp_path / "inner.h5"
    arguments = ["--cell", str(cell_file), "--out", str(out)]
    with running("hal.record", *arguments, "--run", f"hal.record --out {inner} --interval 3600") as program:
        wait_for_frame(tmp_path / "inner.h5.part")
        program.send_signal(signal.SIGINT)
        _, printed = program.communicate(timeout=TIMEOUT_S)
    assert program.returncode == 130 and "Traceback" not in printed
    assert read_recording(out).n_frames == read_recording(inner).n_frames == 1


def test_what_a_killed_program_left_is_not_written_over(cell_file: Path, tmp_path: Path):
    left = tmp_path / "frames.h5.part"
    left.write_bytes(b"precious")
    done = record("--cell", str(cell_file), "--out", str(tmp_path / "frames.h5"))
    assert done.returncode == 2 and "frames.h5.part is there" in done.stderr
    assert left.read_bytes() == b"precious"


def wait_for_frame(recording: Path) -> None:
    """Returns when a frame is in it: then the program waits for the time of the next."""
    deadline = time.monotonic() + TIMEOUT_S
    while time.monotonic() < deadline:
        # It is locked and still being written; after each call it is whole.
        with contextlib.suppress(OSError, KeyError), h5py.File(recording, "r", locking=False) as file:
            if len(file["frames/depth"]) > 0:
                return
        time.sleep(0.1)
    pytest.fail(f"no frame in {recording}")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--frames", "0"], 2, "greater than or equal to 1"),
        (["--run", "mskgrasp.plan 'x"], 2, "No closing quotation"),
        (["--run", "mskgrasp.nope"], 2, "there is no program mskgrasp.nope; python -m mskgrasp lists them"),
        (["--run", "rm -r x"], 2, "the first word must be a program of this project"),
        (["--run", "mskgrasp.plan --cell a.yaml"], 2, "leave out --cell"),
        (["--cell", "none.yaml"], 2, "none.yaml"),
        (["--out", "{cell}"], 2, "exists already"),
        (["--out", "/proc/x.h5"], 2, "choose another file"),
    ],
)
def test_wrong_input_is_one_line(
    cell_file: Path, tmp_path: Path, arguments: list[str], code: int, message: str
):
    given = {"--cell": str(cell_file), "--out": str(tmp_path / "out.h5")}
    given |= dict(zip(arguments[::2], (a.format(cell=cell_file) for a in arguments[1::2]), strict=True))
    done = record(*(word for pair in given.items() for word in pair))
    assert done.returncode == code, done.stderr
    assert message in done.stderr and len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out.h5").exists()
