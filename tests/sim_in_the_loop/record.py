"""The fixed scenario of the sim-in-the-loop test, and how its record is made."""

from __future__ import annotations

import json
from pathlib import Path

import torch

from hal import open_cell
from hal.operator import Operator
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import make_planner
from mskgrasp.trials.engine import TrialEngine
from mskgrasp.trials.measurement import finish, run_trial
from mskgrasp.trials.trial import Trial

HERE = Path(__file__).parent
RECORDED = HERE / "recorded.json"
CELL = HERE.parents[1] / "configs" / "cells" / "sapien.yaml"
PARTS = (
    "jaw_hub_40x16x50",
    "link_plate_45x28",
    "pillow_block_100x42",
    "shackle_10x24",
    "socket_screw_m10x60",
    "two_step_shaft_22x45x70",
)
"""Validation parts: the shipped model was not trained on them, and test parts are not for every day."""
N_CANDIDATES = 400
SEEDS = (11, 12)


def run_scenario() -> list[Trial]:
    """Plans and executes the fixed trials through the cell alone."""
    torch.manual_seed(0)
    trials = []
    with open_cell(CELL) as cell:
        planner = make_planner(PRETRAINED, PlannerConfig(n_candidates=N_CANDIDATES), cell)
        engine = TrialEngine(cell, Operator(cell))
        for part in PARTS:
            for number, seed in enumerate(SEEDS):
                planned = engine.present(part, seed, planner)
                record = run_trial(engine, planned, part=part, number=number, seed=seed)
                trials.append(record.trial)
                finish(engine, record)
    return trials


def main() -> None:
    """Writes the record anew; look at the difference before you commit it."""
    trials = []
    for trial in run_scenario():
        values = trial.to_json()
        del values["planning_s"]  # the machine's, not the scenario's
        trials.append(values)
    RECORDED.write_text(json.dumps({"schema_version": 1, "trials": trials}, indent=1) + "\n")
    for values in trials:
        print(values["part"], values["number"], values["success"], values["reason"])


if __name__ == "__main__":
    main()
