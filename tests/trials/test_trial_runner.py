"""Trials run in this process and in several, and what they leave."""

from __future__ import annotations

import dataclasses
import multiprocessing
import os
import re
import signal
import threading
import time
from multiprocessing.process import BaseProcess as Process
from pathlib import Path

import numpy as np
import pytest

from hal import cell_from_yaml
from hal.operator import Operator
from mskgrasp.core.errors import UsageError
from mskgrasp.core.shipped import PRETRAINED, SIMULATED_CELL
from mskgrasp.dataset import list_shards, read_shard
from mskgrasp.evaluate.experiments import scenes
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.trials.engine import TrialEngine
from mskgrasp.trials.predictors import fit_lowess
from mskgrasp.trials.trial_files import read_trial, trial_file
from mskgrasp.trials.trial_runner import Setup, TrialRunner, TrialTask, run_trials
from tests import synthetic


def hold_a_worker_at_its_first_trial(held: list[Process]) -> None:
    """Stop a worker once it has loaded the renderer, which is within its first trial."""
    while not held:
        for worker in multiprocessing.active_children():
            if "libvulkan_" in Path(f"/proc/{worker.pid}/maps").read_text():
                os.kill(worker.pid or 0, signal.SIGSTOP)
                held.append(worker)
                return
        time.sleep(0.01)


@pytest.mark.slow
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


def test_a_scenes_trials_are_run_here_by_one_worker_written_first_and_named_by_who_chose(tmp_path: Path):
    """The shipped model as its own rival: both choose in one scene; the file is there before the trial."""
    planner = PlannerConfig(policy="quality", n_candidates=40)
    setup = Setup(
        cell=SIMULATED_CELL, models=PRETRAINED, planner=planner, out=tmp_path, compared={"net": PRETRAINED}
    )
    best = TrialTask(part="hex_nut_m30", source="hex_nut_m30", number=0, seed=0, policy="quality")
    scene = (best, dataclasses.replace(best, policy="low_variance", chosen_by="net"))
    found = []
    for trial in run_trials(setup, [scene], 1):
        assert trial_file(tmp_path, trial.key).is_file()
        found.append(trial)
    assert (
        [trial.key for trial in found]
        == [task.key for task in scene]
        == ["hex_nut_m30-000", "hex_nut_m30-000-net"]
    )
    assert [(trial.policy, trial.chosen_by) for trial in found] == [("quality", ""), ("low_variance", "net")]
    assert {trial.family for trial in found} == {"hex_nut"} and found[0].seed == found[1].seed
    frames = [read_trial(trial_file(tmp_path, trial.key))[0].depth for trial in found]
    np.testing.assert_array_equal(*frames)
    assert found[0].quality is not None and found[1].quality is not None
    assert found[0].quality >= found[1].quality
    # The prediction is made with the trial, so that no frame is needed later.
    assert found[0].measured is not None and set(found[0].predictions) == {"net"}
    assert not found[1].predictions  # its own is that of the plan


def test_trials_that_must_be_measured_are_refused_on_a_cell_without_a_tracker(tmp_path: Path):
    cell = cell_from_yaml(SIMULATED_CELL)
    blind = TrialEngine(dataclasses.replace(cell, tracker=None), Operator(cell, yes=True))
    setup = Setup(cell=SIMULATED_CELL, models=PRETRAINED, planner=PlannerConfig(), out=tmp_path)
    with pytest.raises(UsageError, match="no tracker; measure by tape: --measure markers"):
        TrialRunner(blind, dataclasses.replace(setup, must_measure=True))
    data = synthetic.write_dataset(tmp_path / "boxes", n_parts=1, n_attempts=30, seed=0)
    (shard,) = list_shards(data)
    fits, _ = fit_lowess(data, {"box_0": read_shard(shard)[1].part_hash})
    with pytest.raises(UsageError, match="LOWESS needs the part's pose.*omit --lowess-data"):
        TrialRunner(blind, dataclasses.replace(setup, lowess=fits))
