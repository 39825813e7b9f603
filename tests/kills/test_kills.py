"""Programs killed at random moments and started again: nothing is lost, changed or doubled."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.kills.programs import PROGRAMS

REPOSITORY = Path(__file__).parents[2]
KILLS = int(os.environ.get("MSKGRASP_KILLS", "4"))
"""Of each program."""
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)


class Run:
    """One program, started again and again with the same command."""

    def __init__(self, module: str, options: list[str], folder: Path):
        self._command = [sys.executable, "-m", module, *options, "--out"]
        self._folder = folder
        self.log = folder / "log.txt"

    def start(self, out: Path) -> subprocess.Popen[bytes]:
        own = {}
        if self._command[2] == "mskgrasp.assess":  # what is certified in the user's cache is no work left
            own["XDG_CACHE_HOME"] = str(self._folder / f"cache-{out.name}")
        with open(self.log, "ab") as log:
            return subprocess.Popen(
                [*self._command, str(out)], cwd=REPOSITORY, start_new_session=True, stdout=log, stderr=log,
                env=os.environ | own,
            )  # fmt: skip

    def to_the_end(self, out: Path) -> float:
        """Seconds that it takes."""
        begun = time.monotonic()
        assert self.start(out).wait(timeout=1800) == 0, self.log.read_text()
        return time.monotonic() - begun


def kill(process: subprocess.Popen[bytes], number: signal.Signals, alone: bool) -> bool:
    """Kill a program, alone or with its processes as a terminal does; False: it had ended before."""
    if process.poll() is None:
        (os.kill if alone else os.killpg)(process.pid, number)
    return process.wait(timeout=900) != 0


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", PROGRAMS)
def test_kills_lose_change_and_double_nothing(name: str, tmp_path: Path):
    program = PROGRAMS[name]
    run = Run(program.module, program.options(tmp_path), tmp_path)
    seconds = run.to_the_end(tmp_path / "whole")
    whole = program.finished(tmp_path / "whole")
    rng = np.random.default_rng(0)
    signals = [SIGNALS[k % len(SIGNALS)] for k in range(KILLS)]
    lives, before = 0, dict[str, object]()
    out = tmp_path / "life-0"
    for number in [signals[k] for k in rng.permutation(KILLS)]:
        while True:
            process = run.start(out)
            time.sleep(float(rng.uniform(0.3, 1.0)) * seconds)
            killed = kill(process, number, alone=rng.random() < 0.25)
            found = program.finished(out)
            assert found == {key: whole[key] for key in found} and found.keys() >= before.keys()
            if killed:
                before = found
                break
            lives, before = lives + 1, {}  # it was faster: another one is begun
            out = tmp_path / f"life-{lives}"
    run.to_the_end(out)
    for life in range(lives + 1):
        assert program.finished(tmp_path / f"life-{life}") == whole
        left = {path.name for path in (tmp_path / f"life-{life}").iterdir()}
        assert left == {path.name for path in (tmp_path / "whole").iterdir()} >= set(program.files)
        assert not list((tmp_path / f"life-{life}").rglob("*.tmp"))
