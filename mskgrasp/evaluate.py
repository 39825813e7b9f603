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

from hal import Cell, go_home, open_cell
from mskgrasp.cli import make_folder, parse, run
from mskgrasp.config import Config, read_config, write_config
from mskgrasp.errors import BadDataset, NoGraspFound, NoPartFound
from mskgrasp.networks import Models
from mskgrasp.outcomes import draw_errors, print_report, summarise
from mskgrasp.parts import builtin_names, find_part
from mskgrasp.pictures import draw_plan
from mskgrasp.plan import make_planner, present
from mskgrasp.planner import Planner, PlannerConfig
from mskgrasp.trial import Trial, run_trial

DESCRIPTION = """Plans and executes grasps on a cell and reports how often the part was lifted and how well
its displacement in the hand was predicted.

Runs through the hardware abstraction alone: the same program drives the simulated and the real cell.
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
        BadDataset: The folder holds a run with other settings.
    """
    begin(config)
    finished = read_trials(config.out / "trials.jsonl")
    with open_cell(config.cell) as cell:
        planner = make_planner(config.models, config.planner, cell)
        plan = [
            (name, number)
            for name in chosen_parts(config, planner.models)
            for number in range(config.trials)
            if (find_part(name).name, number) not in finished
        ]
        for name, number in tqdm(plan, unit="trial", disable=None):
            trial = _one(cell, planner, config, name, number)
            finished[trial.part, trial.number] = trial
            with (config.out / "trials.jsonl").open("a", encoding="utf-8") as file:
                file.write(json.dumps(trial.to_json(), allow_nan=False) + "\n")
    trials = [finished[key] for key in sorted(finished)]
    report = summarise(trials)
    text = json.dumps(report, indent=1, allow_nan=False)
    (config.out / "report.json").write_text(text + "\n", encoding="utf-8")
    draw_errors(trials, config.out / "errors.png")
    return report


def _one(cell: Cell, planner: Planner, config: EvaluateConfig, name: str, number: int) -> Trial:
    part = find_part(name).name
    seed = int(np.random.SeedSequence([config.seed, number]).generate_state(1)[0] >> 1)
    present(cell, name, seed)
    try:
        trial, frame, plan = run_trial(cell, planner, part=part, number=number, seed=seed)
    except (NoPartFound, NoGraspFound) as error:
        nothing = [0.0] * 4
        return Trial(
            part=part, number=number, seed=seed, success=False, reason=type(error).__name__, grasp=nothing,
            quality=0.0, predicted=nothing, predicted_std=nothing, measured=None, tilt=None, planning_s=0.0,
        )  # fmt: skip
    draw_plan(frame, plan, config.out / "plans" / f"{part}-{number:03d}.png")
    if trial.reason == "collided":
        cell.arm.recover()
    if number + 1 < config.trials:
        go_home(cell)
    return trial


def chosen_parts(config: EvaluateConfig, models: Models) -> list[str]:
    """Names or folders of the parts to try.

    Raises:
        BadPart: A part is unknown.
    """
    names: list[str] = []
    for name in config.parts:
        if name == "validation":
            names += models.meta.training.get("validation_parts", [])
        elif name == "all":
            names += builtin_names()
        else:
            names.append(name)
    for name in names:
        find_part(name)
    return list(dict.fromkeys(names))


def begin(config: EvaluateConfig) -> None:
    """Opens the folder of the run: new, or begun with the same settings.

    Raises:
        BadDataset: It holds something else.
    """
    make_folder(config.out / "plans")
    settings = config.out / "config.yaml"
    if not settings.exists():
        if (config.out / "trials.jsonl").exists():
            raise BadDataset(f"{config.out} holds trials without their settings; choose another --out")
        write_config(config, settings)
        return
    before, now = read_config(EvaluateConfig, settings), config
    changed = [
        name
        for name in EvaluateConfig.model_fields
        if name not in ("out", "trials") and getattr(before, name) != getattr(now, name)
    ]
    if changed:
        raise BadDataset(
            f"{config.out} was begun with other settings ({', '.join(changed)} differ); choose another --out"
        )


def read_trials(path: Path) -> dict[tuple[str, int], Trial]:
    """Trials already done, by part and number; a last line cut short by a kill is dropped.

    Raises:
        BadDataset: The file holds something else.
    """
    if not path.exists():
        return {}
    lines = path.read_text(encoding="utf-8").split("\n")
    found = {}
    for i, line in enumerate(lines[:-1]):
        try:
            values = json.loads(line)
            values["predicted_std"] = [np.nan if v is None else v for v in values["predicted_std"]]
            trial = Trial(**values)
        except (ValueError, TypeError, KeyError) as error:
            raise BadDataset(
                f"{path}: line {i + 1} is no trial; delete it or choose another --out"
            ) from error
        found[trial.part, trial.number] = trial
    if lines[-1]:
        path.write_text("\n".join(lines[:-1]) + ("\n" if len(lines) > 1 else ""), encoding="utf-8")
    return found


if __name__ == "__main__":
    run(main)
