"""Program: plan and execute grasps on a cell and compare. Run ``python -m mskgrasp.evaluate --help``."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field
from rich.console import Console
from tqdm import tqdm

from hal import Cell, go_home, open_cell, put_down
from hal.errors import MotionAborted, OutOfWorkspace
from mskgrasp.cli import make_folder, parse, run
from mskgrasp.config import Config
from mskgrasp.errors import NoGraspFound, NoPartFound
from mskgrasp.models import load_models
from mskgrasp.outcomes import draw_errors, print_report, summarise
from mskgrasp.parts import find_part
from mskgrasp.pictures import draw_plan
from mskgrasp.plan import make_planner, present
from mskgrasp.planner import Planner, PlannerConfig
from mskgrasp.runs import TRIALS, append, begin, inputs_of, part_names, read
from mskgrasp.trial import Trial, run_trial

DESCRIPTION = """Plans and executes grasps on a cell and reports how often the part was lifted and how well
its displacement in the hand was predicted.

Runs through the hardware abstraction alone, so that another cell is another YAML file.
Every finished trial is stored at once; a stopped run goes on where it was."""


class EvaluateConfig(Config):
    """Settings of an evaluation."""

    cell: Path
    """YAML file of the cell, for example configs/cells/sapien.yaml."""
    models: Path
    """Folder with model.safetensors and model.json, as mskgrasp.train writes it."""
    out: Path = Path("out/eval")
    """Folder for trials.jsonl, report.json and the pictures."""
    parts: tuple[str, ...] = ("validation",)
    """Names or folders of parts; "validation": those the model never saw; "all": every built-in part."""
    trials: int = Field(default=5, ge=1)
    """Trials a part."""
    seed: int = Field(default=0, ge=0)
    """Places, turns and candidates follow from it."""
    planner: PlannerConfig = PlannerConfig()
    """How grasps are chosen."""


def main() -> int:
    """Runs the trials and reports."""
    config = parse(EvaluateConfig, prog="python -m mskgrasp.evaluate", description=DESCRIPTION)
    report = evaluate(config)
    print_report(report, Console(width=None if sys.stdout.isatty() else 130))
    print(f"wrote {config.out}/report.json, trials.jsonl, errors.png and a picture of every plan")
    return 0


def evaluate(config: EvaluateConfig) -> dict[str, Any]:
    """Executes the trials that are missing and sums them up.

    Raises:
        UsageError: The folder holds a run with other settings, another model or another cell.
    """
    models = load_models(config.models)
    names = part_names(config.parts, models.meta.training)
    inputs = inputs_of(config.cell, config.models, names)
    begin(config, config.out, inputs, may_change=("out", "trials", "parts"))
    make_folder(config.out / "plans")
    finished = {(trial.part, trial.number): trial for trial in read(config.out / TRIALS, Trial.from_json)}
    missing = [
        (name, number)
        for name in names
        for number in range(config.trials)
        if (find_part(name).name, number) not in finished
    ]
    if missing:
        with open_cell(config.cell) as cell:
            planner = make_planner(config.models, config.planner, cell)
            for name, number in tqdm(missing, unit="trial", file=sys.stderr):
                clear(cell)
                trial = _one(cell, planner, config, name, number)
                finished[trial.part, trial.number] = trial
                # Stored before the arm moves again: what comes now must not cost what is known.
                append(config.out / TRIALS, trial.to_json())
                finish(cell, trial)
            clear(cell)
    trials = [finished[key] for key in sorted(finished)]
    report = summarise(trials)
    text = json.dumps(report, indent=1, allow_nan=False)
    (config.out / "report.json").write_text(text + "\n", encoding="utf-8")
    draw_errors(trials, config.out / "errors.png")
    return report


def finish(cell: Cell, trial: Trial) -> None:
    """Puts a lifted part down again; after a contact the arm may move on, the trial is over."""
    try:
        if trial.reason == "collided":
            cell.arm.recover()
        elif trial.success and trial.grasp is not None:
            put_down(cell, np.array(trial.grasp))
    except MotionAborted:
        cell.arm.recover()


def clear(cell: Cell) -> None:
    """Brings the arm home, out of the camera's sight; after a contact on the way it tries once more.

    Raises:
        MotionAborted: Something still holds it.
    """
    try:
        go_home(cell)
    except MotionAborted:
        cell.arm.recover()
        go_home(cell)


def _one(cell: Cell, planner: Planner, config: EvaluateConfig, name: str, number: int) -> Trial:
    part = find_part(name).name
    seed = int(np.random.SeedSequence([config.seed, number]).generate_state(1)[0] >> 1)
    present(cell, name, seed)
    try:
        trial, frame, plan = run_trial(cell, planner, part=part, number=number, seed=seed)
    except (NoPartFound, NoGraspFound, OutOfWorkspace) as error:
        return Trial(
            part=part, number=number, seed=seed, success=False, reason=type(error).__name__, grasp=None,
            quality=None, predicted=None, predicted_std=None, measured=None, tilt=None, planning_s=None,
        )  # fmt: skip
    draw_plan(frame, plan, config.out / "plans" / f"{part}-{number:03d}.png")
    return trial


if __name__ == "__main__":
    run(main)
