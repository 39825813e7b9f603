"""The collector and its workers killed at random moments of their lives, and resumed each time.

`tests.kills` does the same with other programs; here the moments are those of writing a shard.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.dataset import read_shard
from mskgrasp.dataset.check import check_dataset
from tests.collecting import REPOSITORY, assert_equal, collect, command

KILLS = int(os.environ.get("MSKGRASP_KILLS", "4"))
"""Of each of two runs; 10 for all moments, which take four minutes."""
# What is waited for before the clock starts, and for how many seconds it may run: start-up, a worker's
# start-up, the write and the rename of a shard, the time between shards.
FIRST = ("start", 0.3)  # no Python program has read its settings by then
ALWAYS = (("writing", 0.0), ("writing", 0.02))
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
OTHERS = (*[("start", 3.0)] * 3, *[("worker", 4.0)] * 2, *[("written", 1.0)] * 2)


@dataclass
class Life:
    """What became of the dataset in `out` while its collector was killed again and again."""

    out: Path
    seed: int
    half_written: int = 0
    before_settings: int = 0
    finished: list[int] = field(default_factory=list)

    @property
    def log(self) -> Path:
        return self.out.parent / "log.txt"

    def live(self) -> None:
        rng = np.random.default_rng(self.seed)
        self.out.parent.mkdir()
        others = [OTHERS[k] for k in rng.permutation(len(OTHERS))[: KILLS - 3]]
        later = [*ALWAYS, *others]
        for event, span in [FIRST, *(later[k] for k in rng.permutation(len(later)))]:
            with open(self.log, "ab") as log:
                process = subprocess.Popen(
                    command(self.out, "--workers", "1"), cwd=REPOSITORY, start_new_session=True,
                    stdout=log, stderr=log,
                )  # fmt: skip
            self.wait_for(event, process)
            time.sleep(float(rng.uniform(0, span)))
            # One in four loses the collector alone: its workers are still ending when the next one starts.
            kill = os.kill if rng.random() < 0.25 else os.killpg
            number = signal.SIGKILL if event == "writing" else signal.Signals(int(rng.choice(SIGNALS)))
            if process.poll() is None:
                kill(process.pid, number)
            self.half_written += bool(list(self.out.glob("shards/*.tmp")))
            self.before_settings += not (self.out / "config.yaml").exists()
            process.wait(timeout=30)
            assert process.returncode or not self.missing(), self.log.read_text()
            self.look()

    def wait_for(self, event: str, process: subprocess.Popen[bytes]) -> None:
        shards = self.out / "shards"
        before = self.names(".h5")
        leftovers = self.names(".tmp")
        deadline = time.monotonic() + 120
        while event != "start" and process.poll() is None and self.missing():
            assert time.monotonic() < deadline
            if event == "worker" and has_worker(process.pid):
                return
            # A shard is written in milliseconds: only a close look meets it.
            if event == "writing" and shards.is_dir() and self.names(".tmp") - leftovers:
                return
            if event == "written" and self.names(".h5") - before:
                return
            time.sleep(0.1 if event == "worker" else 0.001)

    def names(self, suffix: str) -> set[str]:
        try:
            return {name for name in os.listdir(self.out / "shards") if name.endswith(suffix)}
        except FileNotFoundError:
            return set()

    def missing(self) -> bool:
        return len(self.names(".h5")) < 4

    def look(self) -> None:
        """Whatever has the name of a shard is whole, and none has been lost."""
        for name in self.names(".h5"):
            read_shard(self.out / "shards" / name)
        self.finished.append(len(self.names(".h5")))
        assert self.finished == sorted(self.finished)


def has_worker(pid: int) -> bool:
    for place in Path("/proc").glob("[0-9]*"):
        try:
            if b"spawn_main" not in (place / "cmdline").read_bytes():
                continue
            if int((place / "stat").read_text().rpartition(")")[2].split()[1]) == pid:
                return True
        except OSError:  # it has just ended
            continue
    return False


@pytest.mark.slow
def test_kills_lose_no_shard_and_change_no_byte(collected, tmp_path):
    lives = [Life(out=tmp_path / name / "data", seed=seed) for seed, name in enumerate("ab")]
    with ThreadPoolExecutor(2) as pool:
        for done in [pool.submit(life.live) for life in lives]:
            done.result()
        for life, done in zip(
            lives, pool.map(lambda life: collect(life.out, "--workers", "1"), lives), strict=True
        ):
            assert done.returncode == 0, done.stderr
            assert len(life.finished) == KILLS
            assert_equal(collected, life.out)
            report = check_dataset(life.out)
            assert not report.faults and report.n_attempts == 12
            assert not [path for path in life.out.rglob("*") if path.suffix == ".tmp"]
    # The moments were what they are meant to be: before anything was there, and within a write.
    assert sum(life.before_settings for life in lives) > 0
    assert sum(life.half_written for life in lives) > 0
