"""Replay of a stored trial without a cell: its frame, plan, predictions and measurement."""

from __future__ import annotations

import dataclasses
import difflib
from pathlib import Path

import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.core.errors import UsageError
from mskgrasp.evaluate.summary import displacement_errors
from mskgrasp.planning.grasp_figures import draw_plan
from mskgrasp.reports.quantities import degrees, millimetres
from mskgrasp.reports.style import saved_figure
from mskgrasp.runtime.run_folder import TRIALS, read_trials
from mskgrasp.trials.trial import REFUSED, Trial
from mskgrasp.trials.trial_files import read_trial, trial_file


def find_trial(run: Path, key: str) -> Trial:
    """Find a trial of a run by its key.

    Raises:
        UsageError: The folder is no run, or has no such trial.
        BadDataset: A line of the file of trials is not a trial.
    """
    if not (run / TRIALS).is_file():
        raise UsageError(f"no run of mskgrasp.evaluate in {run}: there is no {TRIALS}")
    trials = {trial.key: trial for trial in read_trials(run / TRIALS, Trial.from_json)}
    if key not in trials:
        close = difflib.get_close_matches(key, trials, n=3, cutoff=0.4) or list(trials)[:3]
        raise UsageError(
            f"no trial {key!r} in {run}; {len(trials)} trials, for example {', '.join(close) or 'none'}"
        )
    return trials[key]


def draw_trial(run: Path, trial: Trial, path: Path) -> None:
    """Draw a stored trial.

    Raises:
        BadDataset: Its file is missing or damaged.
    """
    frame, plan, _ = read_trial(trial_file(run, trial.key))
    path.parent.mkdir(parents=True, exist_ok=True)
    if plan is None:
        _draw_frame(frame, f"{trial.key}: {outcome_text(trial)}", path)
        return
    plan = dataclasses.replace(plan, seconds={"total": trial.planning_s or 0.0})
    measured = None if trial.measured is None else np.array(trial.measured)
    point = None if trial.point_base is None else np.array(trial.point_base)
    note = f"{trial.key}: {outcome_text(trial)}"
    draw_plan(frame, plan, path, point_base=point, measured=measured, note=note)


def outcome_text(trial: Trial) -> str:
    """Describe the outcome of a trial in one line."""
    if trial.reason == REFUSED:
        return f"not tried (refused: {trial.refusal})"
    if not trial.success:
        return f"not lifted ({trial.reason})"
    if trial.measured is None:
        return f"lifted, not measured ({trial.unmeasured.split(':')[0]})"
    dx, dy, dz, turn = trial.measured
    height = "" if np.isnan(dz) else f", dz {dz * 1e3:+z.1f}"
    shift = f"dx {dx * 1e3:+z.1f}, dy {dy * 1e3:+z.1f}{height} mm, turn {np.degrees(turn):+z.1f} deg"
    text = f"lifted, moved {shift}"
    if trial.predicted is None:
        return text
    distance, angle = displacement_errors(np.array([trial.predicted]), np.array([trial.measured]))
    return f"{text}; prediction off by {millimetres(float(distance[0]))} and {degrees(float(angle[0]))}"


def describe_trial(trial: Trial) -> str:
    """Describe a trial, with a line for every model that predicted its displacement."""
    lines = [f"{trial.key}  ({trial.family}; chosen by {trial.policy.replace('_', ' ')}; seed {trial.seed})"]
    lines.append(f"outcome    {outcome_text(trial)}")
    if trial.unmeasured:
        lines.append(f"           {trial.unmeasured}")
    expected = {"planner": (trial.predicted, trial.predicted_std)} if trial.predicted else {}
    expected |= {label: (one.mean, one.std) for label, one in trial.predictions.items()}
    for label, (mean, std) in expected.items():
        lines.append(f"{label:<10} {_displacement(mean or [], std or [])}")
    if trial.measured is not None:
        lines.append(f"{'measured':<10} {_displacement(trial.measured, [np.nan] * 4)}")
    if trial.true is not None:
        lines.append(f"{'true':<10} {_displacement(trial.true, [np.nan] * 4)}")
    return "\n".join(lines)


def _displacement(mean: list[float], std: list[float]) -> str:
    texts = []
    for name, value, deviation in zip(("dx", "dy", "dz", "turn"), mean, std, strict=True):
        scale, unit = (180 / np.pi, "deg") if name == "turn" else (1e3, "mm")
        number = "-" if np.isnan(value) else f"{value * scale:+z.1f}"
        spread = "" if np.isnan(deviation) else f" +- {deviation * scale:.1f}"
        texts.append(f"{name} {number}{spread} {unit}")
    return ", ".join(texts)


def _draw_frame(frame: RgbdFrame, title: str, path: Path) -> None:
    with saved_figure(path, 9, 4.6) as figure:
        left, right = figure.subplots(1, 2)
        left.imshow(frame.colour)
        left.set_title("colour")
        image = right.imshow(frame.depth, cmap="Greys_r")
        right.set_title("depth, m")
        figure.colorbar(image, ax=right, shrink=0.8)
        for axes in (left, right):
            axes.set(xticks=[], yticks=[])
        figure.suptitle(title, fontsize=11, x=0.01, ha="left")
