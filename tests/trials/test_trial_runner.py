"""Trials run in this process and in several, and what they leave."""

from __future__ import annotations

import multiprocessing
import os
import re
import signal
import threading
import time
from multiprocessing.process import BaseProcess as Process
from pathlib import Path

import pytest

from mskgrasp.evaluate.experiments import scenes
from mskgrasp.learning.grasp_models import PRETRAINED
from mskgrasp.planning.for_cell import SIMULATED_CELL
from mskgrasp.planning.planner import PlannerConfig
from mskgrasp.trials.trial_runner import Setup, run_trials


def hold_a_worker_at_its_first_trial(held: list[Process]) -> None:
    """Stop a worker once it has loaded the renderer, which is within its first trial."""
    while not held:
        for worker in multiprocessing.active_children():
            if "libvulkan_" in Path(f"/proc/{worker.pid}/maps").read_text():
                os.kill(worker.pid or 0, signal.SIGSTOP)
                held.append(worker)
                return
        time.sleep(0.01)


def test_a_trial_whose_process_dies_is_repeated(tmp_path: Path, capfd: pytest.CaptureFixture[str]):
    planner = PlannerConfig(policy="quality", n_candidates=20)
    (tmp_path / "trials").mkdir()
    setup = Setup(cell=SIMULATED_CELL, models=PRETRAINED, planner=planner, out=tmp_path)
    tasks = scenes({"hex_nut_m30": "hex_nut_m30"}, 3, 0, planner, None)
    held: list[Process] = []
    holding = threading.Thread(target=hold_a_worker_at_its_first_trial, args=(held,), daemon=True)
    holding.start()
    made = run_trials(setup, tasks, 2)
    first = next(made)  # by the other process
    holding.join(timeout=0)
    held[0].kill()
    others = list(made)
    assert sorted(one.number for one in (first, *others)) == [0, 1, 2]
    lost = re.findall(r"trial (hex_nut_m30-\d+) is made again", capfd.readouterr().err)
    assert len(lost) == 1 and lost[0] in {one.key for one in others}
    assert not multiprocessing.active_children()
