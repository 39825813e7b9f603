"""What a set of trials amounts to: numbers, a table, a picture of predicted against measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from mskgrasp.metrics import rotation_rmse, translation_rmse, wilson_interval
from mskgrasp.trial import Trial

_COLOURS = {"dx": "#1f6feb", "dy": "#e8590c", "dz": "#8b909a", "turn": "#2b8a3e"}


def summarise(trials: list[Trial]) -> dict[str, Any]:
    """Success and displacement errors, of all trials and of each part.

    Without a single measured success the errors are absent (None), not zero.
    """
    parts = sorted({trial.part for trial in trials})
    return dict(
        schema_version=1,
        overall=_numbers(trials),
        parts={part: _numbers([trial for trial in trials if trial.part == part]) for part in parts},
    )


def _numbers(trials: list[Trial]) -> dict[str, Any]:
    measured = [trial for trial in trials if trial.measured is not None]
    predicted = np.array([trial.predicted for trial in measured])
    true = np.array([trial.measured for trial in measured])
    planning = [trial.planning_s for trial in trials if trial.planning_s is not None]
    n_success = sum(trial.success for trial in trials)
    reasons = sorted({trial.reason for trial in trials if trial.reason})
    return dict(
        trials=len(trials),
        successes=n_success,
        success_rate=n_success / len(trials) if trials else None,
        success_interval=list(wilson_interval(n_success, len(trials))) if trials else None,
        measured=len(measured),
        translation_rmse=translation_rmse(predicted, true) if measured else None,
        rotation_rmse=rotation_rmse(predicted, true) if measured else None,
        translation_rmse_of_zero=translation_rmse(0 * true, true) if measured else None,
        rotation_rmse_of_zero=rotation_rmse(0 * true, true) if measured else None,
        median_planning_s=float(np.median(planning)) if planning else None,
        reasons={reason: sum(trial.reason == reason for trial in trials) for reason in reasons},
    )


def print_report(report: dict[str, Any], console: Console) -> None:
    """A row a part and one for all; "of zero" is the error of predicting no displacement at all."""
    table = Table(title="Planned grasps")
    for name in ("part", "lifted", "95 % interval", "RMSE", "of zero", "turn RMSE", "of zero", "failures"):
        table.add_column(name, justify="left" if name in ("part", "failures") else "right")
    for name, row in [*report["parts"].items(), ("all", report["overall"])]:
        if name == "all":
            table.add_section()
        low, high = row["success_interval"]
        table.add_row(
            name,
            f"{row['successes']} of {row['trials']}",
            f"{low:.0%} - {high:.0%}",
            _unit(row["translation_rmse"], 1e3, "mm"),
            _unit(row["translation_rmse_of_zero"], 1e3, "mm"),
            _unit(row["rotation_rmse"], 180 / np.pi, "deg"),
            _unit(row["rotation_rmse_of_zero"], 180 / np.pi, "deg"),
            ", ".join(f"{reason} {n}" for reason, n in row["reasons"].items()),
        )
    console.print(table)
    if report["overall"]["median_planning_s"] is not None:
        console.print(f"median planning time {report['overall']['median_planning_s']:.2f} s")


def _unit(value: float | None, scale: float, unit: str) -> str:
    return "-" if value is None else f"{value * scale:.1f} {unit}"


def draw_errors(trials: list[Trial], path: Path) -> None:
    """Draws the measured displacement of every success over the predicted one, with its deviation."""
    measured = [trial for trial in trials if trial.measured is not None]
    predicted = np.array([trial.predicted for trial in measured]).reshape(-1, 4)
    deviation = np.array([trial.predicted_std for trial in measured]).reshape(-1, 4)
    true = np.array([trial.measured for trial in measured]).reshape(-1, 4)
    with matplotlib.rc_context({"axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(10, 4.8), layout="constrained")
        shift, turn = figure.subplots(1, 2)
        for k, name in enumerate(("dx", "dy", "dz")):
            _points(shift, predicted[:, k] * 1e3, true[:, k] * 1e3, deviation[:, k] * 1e3, name)
        degrees = [np.degrees(values[:, 3]) for values in (predicted, true, deviation)]
        _points(turn, degrees[0], degrees[1], degrees[2], "turn")
        for axes, unit in ((shift, "mm"), (turn, "deg")):
            axes.axline((0, 0), slope=1, color="#c5c9d0", lw=1, zorder=0)
            low, high = (f(*axes.get_xlim(), *axes.get_ylim()) for f in (min, max))
            axes.set(xlabel=f"predicted, {unit}", ylabel=f"measured, {unit}", aspect="equal")
            axes.set(xlim=(low, high), ylim=(low, high))
        rmse = ("no success was measured", "")
        if measured:
            rmse = (
                f"RMSE {translation_rmse(predicted, true) * 1e3:.1f} mm",
                f"RMSE {np.degrees(rotation_rmse(predicted, true)):.1f} deg",
            )
        shift.set_title(f"Displacement in the hand: {rmse[0]}", loc="left", fontsize=11)
        turn.set_title(f"Turn in the hand: {rmse[1]}", loc="left", fontsize=11)
        shift.legend(frameon=False, loc="lower right")
        figure.savefig(path, dpi=150)


def _points(
    axes: Axes, predicted: np.ndarray, measured: np.ndarray, deviation: np.ndarray, name: str
) -> None:
    known = np.where(np.isfinite(deviation), deviation, 0.0)
    axes.errorbar(
        predicted, measured, xerr=known, fmt="o", ms=4, lw=0.8, alpha=0.8, color=_COLOURS[name], label=name
    )
