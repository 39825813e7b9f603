"""Processor time of a trial of `evaluate`. Run: python -m tests.benchmarks.trial_cost --help.

On one core, in each simulated cell, the same scenes: a part is placed and captured, a grasp is planned and
executed, its displacement is measured and the frame written. The time of building the part's scene is
included, that of the program's start is not.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("LP_NUM_THREADS", "0")  # the software renderer stays in the thread that asks it

import numpy as np

from mskgrasp.core.metrics import bootstrap_interval
from mskgrasp.core.seeds import trial_seeds
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.parts import starter_names
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import make_planner
from mskgrasp.runtime import cli
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.progress import progress
from mskgrasp.trials.engine import TrialEngine, connected_engine
from mskgrasp.trials.measurement import finish, run_trial
from mskgrasp.trials.trial_files import trial_file, write_trial
from tests.benchmarks.report import show

REPOSITORY = Path(__file__).parents[2]
CELLS = {"SAPIEN": "sapien.yaml", "MuJoCo": "mujoco.yaml"}


class Cost(NamedTuple):
    """Processor seconds of a trial: of the scene, its image and the plan; of the grasp and all else."""

    presented: float
    executed: float
    planned: float
    lifted: bool


def main() -> int:
    """Prints the table."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.trial_cost", description="Measure the processor time of a trial."
    )
    parser.add_argument("--parts", type=int, default=8, help="parts of the starter set (default 8)")
    parser.add_argument("--trials", type=int, default=5, help="trials of each part (default 5)")
    parser.add_argument("--out", type=Path, help="folder of report.json and report.md")
    options = parser.parse_args()
    names = starter_names()
    parts = [names[int(i)] for i in np.linspace(0, len(names) - 1, min(options.parts, len(names)))]
    rows = []
    for cell, file in CELLS.items():
        with (
            tempfile.TemporaryDirectory() as folder,
            connected_engine(
                REPOSITORY / "configs" / "cells" / file,
                yes=True,
                picture=Path(folder) / "next.png",
                tape=None,
            ) as engine,
        ):
            costs = measured(engine, Path(folder), parts, options.trials, cell)
        rows.append(row(cell, costs))
    header = ("one core", "s a trial", "interval", "scene, image", "plan", "grasp, all else", "lifted")
    show([Table(header=header, rows=rows)], options.out)
    return 0


def measured(
    engine: TrialEngine, folder: Path, parts: list[str], trials: int, title: str
) -> list[list[Cost]]:
    """Costs of the trials of each part; another trial before them, not counted, loads what is loaded once."""
    planner = make_planner(PRETRAINED, PlannerConfig(), engine.cell)
    (folder / "trials").mkdir()
    found: list[list[Cost]] = []
    scenes = [(part, number) for part in parts for number in range(trials)]
    for part, number in progress([(parts[0], trials), *scenes], unit="trial", title=title):
        seed, _ = trial_seeds(0, part, number)
        began = time.process_time()
        planned = engine.present(part, seed, planner)
        presented = time.process_time()
        record = run_trial(engine, planned, part=part, number=number, seed=seed)
        write_trial(trial_file(folder, record.trial.key), record.frame, record.plan, record.after)
        finish(engine, record)
        ended = time.process_time()
        in_plan = 0.0 if record.plan is None else record.plan.seconds["total"]
        cost = Cost(presented - began - in_plan, ended - presented, in_plan, record.trial.success)
        if number < trials:
            found = found if number else [*found, []]
            found[-1].append(cost)
    return found


def row(cell: str, costs: list[list[Cost]]) -> tuple[str, ...]:
    """Means over all trials, with an interval by parts."""
    every = np.array([cost for part in costs for cost in part])
    whole = [np.array([sum(cost[:3]) for cost in part]) for part in costs]
    low, high = bootstrap_interval(whole, np.mean)
    presented, executed, planned, lifted = every.mean(axis=0)
    means = (f"{value:.2f}" for value in (presented, planned, executed))
    total = presented + executed + planned
    return cell, f"{total:.2f}", f"{low:.2f} - {high:.2f}", *means, f"{lifted:.1%}"


if __name__ == "__main__":
    cli.run("trial_cost", main)
