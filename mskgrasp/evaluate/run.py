"""Run of an experiment: its missing trials, summary and report."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from hal.open_cell import cell_from_values
from mskgrasp.core.errors import BadModel, UsageError
from mskgrasp.core.files import write_whole
from mskgrasp.dataset import list_shards
from mskgrasp.evaluate.comparison import compare_models
from mskgrasp.evaluate.config import EvaluateConfig, Experiment
from mskgrasp.evaluate.experiments import (
    Compared,
    load_compared,
    model_folders,
    own_choices,
    scenes,
    with_predictions,
)
from mskgrasp.evaluate.figures import draw_comparison, draw_displacements, draw_success
from mskgrasp.evaluate.replay_trial import describe_trial, draw_trial, find_trial, outcome_text
from mskgrasp.evaluate.report import TITLES, Report, conclusion, report_sections
from mskgrasp.evaluate.summary import SuccessSummary, largest_errors, summarise_trials, worst_trials
from mskgrasp.learning.grasp_models import load_models, require_model
from mskgrasp.parts import find_part, starter_names
from mskgrasp.parts.select_parts import part_names
from mskgrasp.planning.for_cell import tell_model
from mskgrasp.planning.run_inputs import (
    BY_CONTENT,
    calibration_digest,
    keep_certified,
    model_digests,
    part_digests,
)
from mskgrasp.reports.html import write_html
from mskgrasp.runtime.cli import make_folder
from mskgrasp.runtime.progress import note, progress
from mskgrasp.runtime.run_folder import (
    TRIALS,
    append_trial,
    opened_run,
    read_trials,
    resume_trials,
    rewrite_trials,
)
from mskgrasp.runtime.worker_pool import process_count
from mskgrasp.simulation.certify_parts import certify_missing
from mskgrasp.simulation.versions import versions
from mskgrasp.trials.cell_file import CellFile, check_loads, read_cell
from mskgrasp.trials.trial import Trial
from mskgrasp.trials.trial_files import FOLDER, trial_file
from mskgrasp.trials.trial_runner import SCENE_VERSION, Setup, TrialTask, run_trials

PARTS: dict[Experiment, tuple[str, ...]] = {
    "success": ("validation",),
    "displacement": ("train", "validation"),
}


MAY_CHANGE = (
    "out", "trials", "parts", "n_parts", "compare", "chooses", "lowess_data", "workers", "estimate", "yes",
    "replay", *BY_CONTENT,
)  # fmt: skip


def replay(out: Path, key: str) -> None:
    """Draw a stored trial of a run and print its outcome."""
    trial = find_trial(out, key)
    picture = out / "replay" / f"{trial.key}.png"
    draw_trial(out, trial, picture)
    print(describe_trial(trial))
    print(f"wrote {picture}")


@dataclass(frozen=True, kw_only=True)
class Prepared:
    """An experiment whose inputs are checked.

    Attributes:
        config: Settings, those of a real cell where it is one.
        cell: The cell's file.
        sources: Names or folders of the parts.
        compared: Models of the displacement experiment.
        tasks: Its trials by scene.
        inputs: Digests of what the results depend on.
    """

    config: EvaluateConfig
    cell: CellFile
    sources: list[str]
    compared: Compared | None
    tasks: list[tuple[TrialTask, ...]]
    inputs: dict[str, str]


def prepare(config: EvaluateConfig) -> Prepared:
    """Check the inputs of an experiment, and list its trials.

    Raises:
        UsageError: Settings do not fit together.
        MskgraspError: A model, a part or the cell cannot be used, or the arm cannot carry a part.
    """
    _check(config)
    models = load_models(config.models)
    if config.planner.policy != "quality" and not models.meta.network.variance:
        raise BadModel(
            f"{config.models} predicts no variance; use --planner.policy quality, or another model"
        )
    cell = read_cell(config.cell, noise=config.noise, measure=config.measure, tape=config.tape)
    if not cell.simulated:  # in simulation nothing breaks, and a bound would hide what poor grasps do
        config = config.model_copy(update={"planner": config.planner.for_motion()})
    if config.workers > 1 and not cell.simulated:
        raise UsageError(f"--workers {config.workers}: {config.cell} is one cell; omit --workers")
    # Parts come last: those that are missing are built, which takes a while.
    words = config.parts or PARTS[config.experiment]
    sources = part_names(words, models.meta.training, config.n_parts)
    if not sources:
        raise UsageError("--parts names no held-out part; name another set or parts")
    found = [find_part(source) for source in sources]
    check_loads(config.cell, found)
    parts = {part.name: source for part, source in zip(found, sources, strict=True)}
    compared, chooses = None, {}
    if config.experiment == "displacement":
        chunk, hashes = config.planner.chunk_size, {part.name: part.content_hash for part in found}
        compared = load_compared(config.compare, config.models, config.lowess_data, hashes, chunk)
        chooses = own_choices(config.chooses, compared)
    inputs = {"cell": cell.digest} | model_digests(config.models) | part_digests(parts.values())
    inputs |= calibration_digest(cell.path)
    inputs |= compared.inputs if compared is not None else {}
    tell_model(models, cell_from_values(cell.values, cell.path))
    return Prepared(
        config=config, cell=cell, sources=sources, compared=compared, inputs=inputs,
        tasks=scenes(parts, config.trials, config.seed, config.planner, compared, chooses),
    )  # fmt: skip


def evaluate(config: EvaluateConfig) -> Report:
    """Execute the missing trials and report on all.

    Raises:
        UsageError: Settings do not fit together, or the folder holds a run with other inputs.
        MskgraspError: A model, a part or the cell cannot be used, or the arm cannot carry a part.
    """
    one = prepare(config)
    config, compared, tasks = one.config, one.compared, one.tasks
    with opened_run(config, config.out, one.inputs, scene_version=SCENE_VERSION, may_change=MAY_CHANGE):
        if config.planner.policy == "certified":
            certify_missing(one.sources, config.models, config.workers, clearance=one.cell.clearance)
            keep_certified(config.out, one.sources)
        trials = _make_trials(one)
        if compared is not None:
            trials = _with_predictions(config, trials, compared)
        return _report(config, one.cell, compared, [trials[task.key] for scene in tasks for task in scene])


def estimate(config: EvaluateConfig) -> float:
    """Measure trials of two parts of the starter set, and state how long the missing ones take.

    Returns:
        The time, seconds.

    Raises:
        UsageError: The cell is not simulated, or as `evaluate`.
    """
    one = prepare(config)
    if not one.cell.simulated:
        raise UsageError(f"--estimate: {config.cell} is not simulated; omit --estimate")
    stored = {trial.key for trial in read_trials(config.out / TRIALS, Trial.from_json)}
    missing = [task for scene in one.tasks for task in scene if task.key not in stored]
    names = starter_names()[:: len(starter_names()) // 2][:2]
    planner = config.planner
    if planner.policy == "certified":  # the parts of the sample have no certified grasps
        planner = planner.model_copy(update={"policy": "low_variance"})
    sampled = replace(one, config=one.config.model_copy(update={"planner": planner}))
    sample = scenes({name: name for name in names}, 2, config.seed, planner, one.compared)
    seconds: dict[bool, list[float]] = {False: [], True: []}
    with TemporaryDirectory() as folder:
        before = time.perf_counter()
        for trial in run_trials(_setup(sampled, Path(folder)), sample, 1):
            now = time.perf_counter()
            if trial.key != sample[0][0].key:  # the first one waits for the cell
                seconds[bool(trial.chosen_by)].append(now - before)
            before = now
    n_workers = process_count(config.workers)
    total = 0.0
    for chosen, what in ((False, "of the run's policy"), (True, "chosen by a model's variances")):
        n = sum(bool(task.chosen_by) == chosen for task in missing)
        if n:
            measured = seconds[chosen] or seconds[not chosen]  # lowess knows no part of the starter set
            each = float(np.mean(measured))
            total += n * each / n_workers
            like = "" if seconds[chosen] else " as long as the others,"
            print(f"{n} trials {what},{like} {each:.1f} s each (of {len(measured)} measured)")
    if config.planner.policy == "certified":
        print("before them the certified grasps that are missing are made, some minutes a part")
    duration = f"{total / 3600:.1f} h" if total > 3600 else f"{total / 60:.1f} min"
    print(
        f"{len(missing)} of {sum(map(len, one.tasks))} trials are missing: about {duration} with "
        f"{n_workers} processes, if each is as fast as the one that was measured"
    )
    return total


def _check(config: EvaluateConfig) -> None:
    if config.experiment == "success" and (config.compare or config.chooses or config.lowess_data):
        raise UsageError("--compare, --chooses and --lowess-data need --experiment displacement; add it")
    if config.experiment == "displacement" and config.planner.policy == "low_variance":
        raise UsageError("--experiment displacement runs this policy anyway; omit --planner.policy")
    if config.experiment == "displacement" and config.planner.check_fingers:
        raise UsageError(
            "--experiment displacement gives all models the same candidates; omit --planner.check-fingers"
        )
    if config.experiment == "displacement":
        for folder in model_folders(config.compare, config.models).values():
            require_model(folder)
    if config.lowess_data is not None:
        list_shards(config.lowess_data)


def _setup(one: Prepared, out: Path) -> Setup:
    config, cell, compared = one.config, one.cell, one.compared
    return Setup(
        cell=cell.write(out),
        models=config.models,
        planner=config.planner,
        out=out,
        compared=compared.folders if compared is not None else {},
        lowess=compared.lowess.fits if compared is not None and compared.lowess is not None else {},
        tape=cell.tape,
        must_measure=compared is not None,
        yes=config.yes,
    )


def _make_trials(one: Prepared) -> dict[str, Trial]:
    """Make the missing trials; all trials of the folder by key."""
    config, cell, tasks = one.config, one.cell, one.tasks
    make_folder(config.out / FOLDER)
    for leftover in (config.out / FOLDER).glob("*.tmp"):
        leftover.unlink()
    trials = {trial.key: trial for trial in resume_trials(config.out / TRIALS, Trial.from_json)}
    missing = [tuple(task for task in scene if task.key not in trials) for scene in tasks]
    missing = [scene for scene in missing if scene]
    if not missing:
        return trials
    n = sum(map(len, missing))
    done = sum(map(len, tasks)) - n
    bar = progress(total=n + done, done=done, unit="trial", keep=True)
    n_lifted = sum(trials[task.key].success for scene in tasks for task in scene if task.key in trials)
    n_workers = min(process_count(config.workers), len(missing)) if cell.simulated else 1
    with closing(run_trials(_setup(one, config.out), missing, n_workers)) as made, bar:
        for k, trial in enumerate(made, done + 1):
            append_trial(config.out / TRIALS, trial.to_json())
            trials[trial.key] = trial
            n_lifted += trial.success
            bar.set_postfix_str(f"lifted {n_lifted / k:.0%}", refresh=False)
            bar.update()
    # Sorted: workers finish in any order.
    rewrite_trials(config.out / TRIALS, (trials[key].to_json() for key in sorted(trials)))
    return trials


def _with_predictions(
    config: EvaluateConfig, trials: dict[str, Trial], compared: Compared
) -> dict[str, Trial]:
    """Add the models' missing predictions for the grasps of the best quality."""
    bar = progress(trials.items(), title="predictions", unit="trial")
    more = {key: with_predictions(trial, config.out, compared.predictors) for key, trial in bar}
    if more != trials:
        rewrite_trials(config.out / TRIALS, (more[key].to_json() for key in sorted(more)))
    return more


def _report(
    config: EvaluateConfig, cell: CellFile, compared: Compared | None, trials: Sequence[Trial]
) -> Report:
    """Write the report and its pictures."""
    summary = summarise_trials(trials) if compared is None else compare_models(trials, compared.predictors)
    worst = worst_trials(trials) if compared is None else largest_errors(trials)
    here = [trial for trial in worst if trial_file(config.out, trial.key).exists()]
    if len(here) < len(worst):
        note(
            f"{len(worst) - len(here)} of the {len(worst)} worst trials were made on another machine and "
            f"have no file in {config.out / FOLDER}: no picture"
        )
        worst = here
    settings = config.model_dump(mode="json", exclude={"replay"}) | dict(
        parts=sorted({trial.part for trial in trials}),
        noise=cell.noise or None,
    )
    report = Report(
        summary=summary,
        trials={trial.key: outcome_text(trial) for trial in trials},
        worst={_picture(trial): f"{trial.key}: {outcome_text(trial)}" for trial in worst},
        settings=settings,
        versions=versions(),
    )
    for earlier in (config.out / "worst").glob("*.png"):
        earlier.unlink()
    for trial in worst:
        draw_trial(config.out, trial, config.out / _picture(trial))
    if isinstance(summary, SuccessSummary):
        draw_success(summary, config.out / "success.png")
        draw_displacements(trials, config.out / "errors.png")
    else:
        draw_comparison(summary, config.out / "displacement.png")
    text = json.dumps(report.to_json(), indent=1, allow_nan=False)
    write_whole(config.out / "report.json", (text + "\n").encode())
    write_html(
        config.out / "report.html", title=TITLES[config.experiment], conclusion=conclusion(summary),
        sections=report_sections(report, config.out),
    )  # fmt: skip
    return report


def _picture(trial: Trial) -> str:
    """Path of a worst trial's picture in the run's folder."""
    return f"worst/{trial.key}.png"
