"""Program: plan and execute grasps on a cell and compare. Run ``python -m mskgrasp.evaluate --help``."""

from __future__ import annotations

import hashlib
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
from mskgrasp.config import Config, read_config, write_config
from mskgrasp.errors import BadDataset, NoGraspFound, NoPartFound, UsageError
from mskgrasp.models import Models, load_models
from mskgrasp.outcomes import draw_errors, print_report, summarise
from mskgrasp.parts import find_part, starter_names
from mskgrasp.pictures import draw_plan
from mskgrasp.plan import make_planner, present
from mskgrasp.planner import Planner, PlannerConfig
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
    names = chosen_parts(config, models)
    begin(config, names)
    finished = read_trials(config.out / "trials.jsonl")
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
                with (config.out / "trials.jsonl").open("a", encoding="utf-8") as file:
                    file.write(json.dumps(trial.to_json(), allow_nan=False) + "\n")
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
            names += starter_names()
        else:
            names.append(name)
    for name in names:
        find_part(name)
    return list(dict.fromkeys(names))


def begin(config: EvaluateConfig, names: list[str]) -> None:
    """Opens the folder of the run: new, or begun with the same settings, model, cell and parts.

    Raises:
        UsageError: It holds something else.
    """
    inputs = {
        "cell": _digest(config.cell),
        "model.json": _digest(config.models / "model.json"),
        "model.safetensors": _digest(config.models / "model.safetensors"),
    } | {f"part {name}": find_part(name).content_hash for name in names}
    settings, fingerprint = config.out / "config.yaml", config.out / "inputs.json"
    if settings.exists() and fingerprint.exists():
        before = read_config(EvaluateConfig, settings)
        changed = [
            name
            for name in EvaluateConfig.model_fields
            if name not in ("out", "trials", "parts") and getattr(before, name) != getattr(config, name)
        ]
        known = json.loads(fingerprint.read_text(encoding="utf-8"))
        changed += [name for name, value in inputs.items() if known.get(name, value) != value]
        if changed:
            raise UsageError(
                f"{config.out} was begun with other inputs ({', '.join(changed)} differ); "
                "choose another --out"
            )
        inputs = known | inputs
    elif config.out.is_dir() and any(config.out.iterdir()):
        raise UsageError(f"--out {config.out} holds other files; choose a new folder")
    make_folder(config.out / "plans")
    write_config(config, settings)
    fingerprint.write_text(json.dumps(inputs, indent=1) + "\n", encoding="utf-8")


def _digest(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror}") from error


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
            if values["predicted_std"] is not None:
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
