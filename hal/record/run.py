"""Recording of a cell: frames of its camera, or a whole run."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

import yaml

from hal.open_cell import cell_from_yaml
from hal.record.config import RecordConfig
from hal.replay import read_recording
from hal.replay.cell import recorded_cell
from mskgrasp.core.errors import UsageError
from mskgrasp.runtime.options import parse

DESCRIPTION = """Writes the frames of a cell's camera, or a whole run on the cell, into one file.

The file plays back as a cell (type: replay), a camera or an arm (driver: replay): see docs/replay.md.
Without --run the arm's state is read with every frame and the arm does not move.

Ten frames: python -m hal.record --cell configs/cells/sapien.yaml --out frames.h5

A whole run: python -m hal.record --cell configs/cells/sapien.yaml --out run.h5 --run mskgrasp.plan"""


def main() -> int:
    """Record, and print what the file holds."""
    config = parse(RecordConfig, prog="python -m hal.record", description=DESCRIPTION)
    code = _frames(config) if config.run is None else _run(config, config.run)
    if not config.out.exists():
        return code or 1  # the program has reported why
    recording = read_recording(config.out)
    moved = sum(event.after is not None for event in recording.events)
    print(
        f"wrote {config.out}: {recording.n_frames} frames, {moved} commands to the arm, "
        f"{len(recording.events)} calls in all"
    )
    return code


def _frames(config: RecordConfig) -> int:
    """Capture frames, each with the arm's state, so that both can be related later."""
    with recorded_cell(cell_from_yaml(config.cell), config.out).connected() as cell:
        due_s = time.monotonic()
        for _ in range(config.frames):
            time.sleep(max(0.0, due_s - time.monotonic()))
            due_s += config.interval
            cell.arm.state()
            cell.camera.capture()
    return 0


def _run(config: RecordConfig, command: str) -> int:
    """Run a program of this project on the recorded cell, and return its exit code."""
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise UsageError(f"--run {command!r}: {error}; close the quote") from error
    if words[:1] == ["mskgrasp"] and len(words) > 1:  # as on the command line
        words = [f"mskgrasp.{words[1]}", *words[2:]]
    if not words or words[0].split(".")[0] not in ("mskgrasp", "hal"):
        raise UsageError(
            f"--run {command!r}: the first word must be a program of this project, such as mskgrasp.plan"
        )
    if find_spec(words[0]) is None:
        raise UsageError(f"--run {command!r}: there is no program {words[0]}; python -m mskgrasp lists them")
    if any(word.split("=")[0] == "--cell" for word in words):
        raise UsageError("--run: leave out --cell, the recorded cell takes its place")
    cell_from_yaml(config.cell)  # an invalid file is reported here, not by the program
    if config.out.exists():
        raise UsageError(f"{config.out} exists already; move it away or choose another --out")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "recorded.yaml"
        values = dict(type="recorded", cell=str(config.cell.resolve()), out=str(config.out.resolve()))
        path.write_text(yaml.safe_dump(values), encoding="utf-8")
        arguments = [sys.executable, "-m", words[0], "--cell", str(path), *words[1:]]
        process = subprocess.Popen(arguments)
        while True:
            try:
                return process.wait()
            except KeyboardInterrupt:
                # A second one would interrupt the program while it stops the arm and finishes the file.
                if not _in_foreground():
                    process.send_signal(signal.SIGINT)


def _in_foreground() -> bool:
    """Whether a terminal sends Ctrl-C to this program, and so to all that it has started."""
    try:
        terminal = os.open("/dev/tty", os.O_RDONLY | os.O_NOCTTY)
    except OSError:
        return False
    try:
        return os.tcgetpgrp(terminal) == os.getpgrp()
    finally:
        os.close(terminal)
