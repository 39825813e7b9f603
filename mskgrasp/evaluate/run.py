"""The paper's experiments on any cell: trials, summary and report."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

from mskgrasp.core.errors import BadModel, UsageError
from mskgrasp.core.files import exclusive_lock, write_whole
from mskgrasp.evaluate.comparison import compare
from mskgrasp.evaluate.config import EvaluateConfig, Experiment
from mskgrasp.evaluate.experiments import (
    Compared,
    load_compared,
    open_model,
    scenes,
    with_predictions,
)
from mskgrasp.evaluate.figures import draw_comparison, draw_errors, draw_success
from mskgrasp.evaluate.replay_trial import describe_trial, draw_trial, find_trial, outcome_text
from mskgrasp.evaluate.report import TITLES, conclusion, sections
from mskgrasp.evaluate.summary import farthest_off, summarise, worst_trials
from mskgrasp.parts import find_part
from mskgrasp.parts.select_parts import part_names
from mskgrasp.planning.run_inputs import model_digests, part_digests
from mskgrasp.reports.html import write_html
from mskgrasp.runtime.cli import make_folder
from mskgrasp.runtime.progress import progress
from mskgrasp.runtime.run_folder import (
    TRIALS,
    append_trial,
    open_run_folder,
    read_trials,
    rewrite_trials,
)
from mskgrasp.simulation.versions import versions
from mskgrasp.trials.cell_file import CellFile, read_cell
from mskgrasp.trials.trial import Trial
from mskgrasp.trials.trial_files import FOLDER
from mskgrasp.trials.trial_runner import Setup, TrialTask, run_trials

PARTS: dict[Experiment, tuple[str, ...]] = {
    "success": ("validation",),
    "displacement": ("train", "validation"),
}


MAY_CHANGE = ("out", "trials", "parts", "n_parts", "compare", "lowess_data", "workers", "yes", "replay")


def replay(out: Path, key: str) -> int:
    """Draws a stored trial of a run and says what came of it."""
    trial = find_trial(out, key)
    picture = out / "replay" / f"{trial.key}.png"
    draw_trial(out, trial, picture)
    print(describe_trial(trial))
    print(f"wrote {picture}")
    return 0


def evaluate(config: EvaluateConfig) -> dict[str, Any]:
    """Executes the trials that are missing and sums them up.

    Raises:
        UsageError: The folder holds a run with other settings, another model or another cell.
        MskgraspError: A model, a part or the cell cannot be used.
    """
    _check(config)
    models = open_model(config.models)
    words = config.parts or PARTS[config.experiment]
    parts = _parts(part_names(words, models.meta.training, config.n_parts))
    if config.planner.policy == "low_variance" and not models.meta.network.variance:
        raise BadModel(
            f"{config.models} predicts no variance; use --planner.policy quality, or another model"
        )
    cell = read_cell(config.cell, noise=config.noise, measure=config.measure, tape=config.tape)
    if config.workers > 1 and not cell.simulated:
        raise UsageError(f"--workers {config.workers}: there is one cell of {config.cell}; leave it away")
    compared = None
    if config.experiment == "displacement":
        chunk = config.planner.chunk_size
        compared = load_compared(config.compare, config.models, config.lowess_data, list(parts), chunk)
    inputs = {"cell": cell.digest} | model_digests(config.models) | part_digests(parts.values())
    inputs |= compared.inputs if compared is not None else {}
    open_run_folder(config, config.out, inputs, may_change=MAY_CHANGE)
    with exclusive_lock(config.out) as alone:
        if not alone:
            raise UsageError(
                f"another evaluation writes into {config.out}; wait for it, or choose another --out"
            )
        tasks = scenes(parts, config.trials, config.seed, config.planner, compared)
        trials = _make_trials(config, cell, compared, tasks)
        if compared is not None:
            trials = _with_predictions(config, trials, compared)
        return _report(config, cell, compared, [trials[task.key] for scene in tasks for task in scene])


def _check(config: EvaluateConfig) -> None:
    if config.experiment == "success" and (config.compare or config.lowess_data):
        raise UsageError("--compare and --lowess-data are for --experiment displacement: add that")
    if config.experiment == "displacement" and config.planner.policy != "quality":
        raise UsageError("--experiment displacement runs both policies: leave --planner.policy away")
    if config.experiment == "displacement" and config.planner.searches:
        raise UsageError(
            "--experiment displacement shows all models the same candidates: leave --planner.refinements and "
            "--planner.check-fingers away"
        )


def _parts(words: Sequence[str]) -> dict[str, str]:
    """What the user called each part, by its name."""
    parts: dict[str, str] = {}
    for word in words:
        name = find_part(word).name
        if name in parts:
            raise UsageError(f"--parts: {parts[name]} and {word} are both called {name!r}; leave one away")
        parts[name] = word
    if not parts:
        raise UsageError("--parts names no part that the model was not trained on; name another set or parts")
    return parts


def _make_trials(
    config: EvaluateConfig, cell: CellFile, compared: Compared | None, tasks: Sequence[tuple[TrialTask, ...]]
) -> dict[str, Trial]:
    """All trials of the folder by key, those that were missing made now."""
    make_folder(config.out / FOLDER)
    for leftover in (config.out / FOLDER).glob("*.tmp"):
        leftover.unlink()
    trials = {trial.key: trial for trial in read_trials(config.out / TRIALS, Trial.from_json)}
    missing = [tuple(task for task in scene if task.key not in trials) for scene in tasks]
    missing = [scene for scene in missing if scene]
    if not missing:
        return trials
    setup = Setup(
        cell=cell.write(config.out),
        models=config.models,
        planner=config.planner,
        out=config.out,
        choosers=compared.choosers if compared is not None else {},
        lowess=compared.lowess.fits if compared is not None and compared.lowess is not None else {},
        tape=cell.tape,
        must_measure=compared is not None,
        yes=config.yes,
    )
    n = sum(map(len, missing))
    done = sum(map(len, tasks)) - n
    bar = progress(total=n + done, done=done, unit="trial", keep=True)
    n_lifted = 0
    n_workers = min(config.workers or os.cpu_count() or 1, len(missing)) if cell.simulated else 1
    with closing(run_trials(setup, missing, n_workers)) as made, bar:
        for k, trial in enumerate(made, 1):
            append_trial(config.out / TRIALS, trial.to_json())
            trials[trial.key] = trial
            n_lifted += trial.success
            bar.set_postfix_str(f"lifted {n_lifted / k:.0%}", refresh=False)
            bar.update()
    # In the order of their names, whoever was first.
    rewrite_trials(config.out / TRIALS, (trials[key].to_json() for key in sorted(trials)))
    return trials


def _with_predictions(
    config: EvaluateConfig, trials: dict[str, Trial], compared: Compared
) -> dict[str, Trial]:
    """Adds what each model expects of the grasps of best quality, where that is not known yet."""
    bar = progress(trials.items(), title="predictions", unit="trial")
    more = {key: with_predictions(trial, config.out, compared.predictors) for key, trial in bar}
    if more != trials:
        rewrite_trials(config.out / TRIALS, (more[key].to_json() for key in sorted(more)))
    return more


def _report(
    config: EvaluateConfig, cell: CellFile, compared: Compared | None, trials: Sequence[Trial]
) -> dict[str, Any]:
    """Writes the report and its pictures."""
    body = summarise(trials) if compared is None else compare(trials, compared.predictors)
    worst = worst_trials(trials) if compared is None else farthest_off(trials)
    pictures = {trial.key: f"worst/{trial.key}.png" for trial in worst}
    settings = config.model_dump(mode="json", exclude={"replay"}) | dict(
        parts=sorted({trial.part for trial in trials}),
        noise=cell.noise or None,
    )
    report = dict(
        experiment=config.experiment,
        **body,
        trials=[dict(trial=trial.key, outcome=outcome_text(trial)) for trial in trials],
        worst=[[pictures[trial.key], f"{trial.key}: {outcome_text(trial)}"] for trial in worst],
        settings=settings,
        versions=versions(),
    )
    for earlier in (config.out / "worst").glob("*.png"):
        earlier.unlink()
    for trial in worst:
        draw_trial(config.out, trial, config.out / pictures[trial.key])
    if compared is None:
        draw_success(report, config.out / "success.png")
        draw_errors(trials, config.out / "errors.png")
    else:
        draw_comparison(report, config.out / "displacement.png")
    text = json.dumps(report, indent=1, allow_nan=False)
    write_whole(config.out / "report.json", (text + "\n").encode())
    write_html(
        config.out / "report.html", title=TITLES[config.experiment], conclusion=conclusion(report),
        sections=sections(report, config.out),
    )  # fmt: skip
    return report
