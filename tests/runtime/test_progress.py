"""Progress on a terminal is a bar, in a pipe lines."""

from __future__ import annotations

import subprocess
import sys

from mskgrasp.runtime import progress as module
from mskgrasp.runtime.progress import advance_to, progress


def test_in_a_pipe_a_resumed_bar_is_lines_that_start_at_what_is_done(capsys, monkeypatch):
    monkeypatch.setattr(module, "_LINE_EVERY_S", 0.0)
    with progress(total=10, done=4, unit="trial", title="work", keep=True) as bar:
        bar.update(3)
    written = capsys.readouterr().err
    lines = written.splitlines()
    assert "4/10" in lines[0] and "7/10" in lines[-1] and all("work" in line for line in lines)
    assert "\r" not in written and "" not in lines


def test_between_two_lines_in_a_pipe_is_a_pause(capsys):
    with progress(total=1000, unit="trial", keep=True) as bar:
        for _ in range(1000):
            bar.update()
    assert len(capsys.readouterr().err.splitlines()) == 2


def test_a_short_stage_says_nothing(capsys):
    for _ in progress(range(5), unit="part"):
        pass
    assert capsys.readouterr().err == ""


def test_a_total_may_be_known_late(capsys):
    with progress(unit="shard", keep=True) as bar:
        advance_to(bar, 2, 8)
        advance_to(bar, 5, 8)
        assert (bar.n, bar.total) == (5, 8)


def test_a_note_makes_no_semaphore_which_a_worker_that_is_ended_would_leak():
    code = (
        "import multiprocessing\n"
        "from multiprocessing.resource_tracker import _resource_tracker as tracker\n"
        "multiprocessing.set_start_method('spawn')\n"  # as in a worker
        "from mskgrasp.runtime.progress import note, progress\n"
        "note('read'); list(progress(range(2), unit='part', keep=True))\n"
        "raise SystemExit(tracker._fd is not None)"  # running, for want of anything else: for a semaphore
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
