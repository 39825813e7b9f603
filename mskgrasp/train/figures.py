"""Figures of a training: learning curves, and calibration of the predicted uncertainty."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from mskgrasp.core import metrics
from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.palette import BLUE, FAINT, GREEN, ORANGE
from mskgrasp.core.predicted_intervals import HalfWidth, coverage
from mskgrasp.learning.grasp_models import Models
from mskgrasp.learning.held_out import (
    AXES,
    centroid_displacement,
    predict_grasp_displacement,
    predict_quality,
    true_outcomes,
)
from mskgrasp.learning.model_metrics import EpochMetrics
from mskgrasp.learning.samples import Samples
from mskgrasp.reports.style import saved_figure

_TITLES = {"gqn": "GQN", "gdn": "GDN"}
_COLOURS = (BLUE, ORANGE, FAINT, GREEN)
_BINS = 12
_MM = 1e3


def draw_uncertainty(models: Models, samples: Samples, rows: torch.Tensor, path: Path) -> None:
    """Draw reliability, coverage, sparsification and error over deviation on some rows.

    Args:
        models: Networks that predict a variance.
        samples: The dataset.
        rows: Rows of held-out parts, successes among them.
        path: The picture, PNG.
    """
    held = rows[samples.success[rows]]
    mean, variance = predict_grasp_displacement(models, samples, held)
    target = true_outcomes(samples, held, mean)
    with saved_figure(path, 11.5, 9.0) as figure:
        panels = figure.subplots(2, 2)
        _reliability(panels[0, 0], predict_quality(models, samples, rows), samples.success[rows].numpy())
        _coverage(panels[0, 1], mean, variance, target, models.meta.calibration.half_width)
        predicted, expected = centroid_displacement(samples, held, mean, variance)
        error = samples.displacement[held].double().numpy() - predicted
        shift, turn = np.linalg.norm(error[:, :3], axis=1), np.abs(wrap_angle(error[:, 3]))
        _sparsification(panels[1, 0], shift, expected[:, :3].sum(axis=1))
        _error_over_deviation(panels[1, 1], shift, turn, expected)


def _reliability(axes: Axes, probability: np.ndarray, success: np.ndarray) -> None:
    rows = metrics.reliability(probability, success)
    axes.plot([0, 1], [0, 1], color=FAINT, lw=1, ls="--")
    axes.scatter(rows[:, 0], rows[:, 1], s=8 + 200 * rows[:, 2] / rows[:, 2].sum(), color=_COLOURS[0])
    axes.plot(rows[:, 0], rows[:, 1], color=_COLOURS[0], lw=1.5)
    axes.set(xlabel="predicted probability of success", ylabel="share that succeeded", aspect="equal")
    axes.set_title("Quality: calibration")


def _coverage(
    axes: Axes,
    mean: np.ndarray,
    variance: np.ndarray,
    target: np.ndarray,
    half_width: HalfWidth,
) -> None:
    levels = np.linspace(0.05, 0.95, 19)
    covered = np.stack([coverage(mean, variance, target, level, half_width) for level in levels])
    axes.plot([0, 1], [0, 1], color=FAINT, lw=1, ls="--")
    for k, name in enumerate(AXES[: covered.shape[1]]):
        axes.plot(levels, covered[:, k], color=_COLOURS[k % 4], lw=1.5, ls="-" if k < 4 else ":", label=name)
    axes.set(xlabel="central interval of the prediction", ylabel="share of truth inside", aspect="equal")
    axes.set_title("Displacement: coverage of predicted intervals")
    axes.legend()


def _sparsification(axes: Axes, error: np.ndarray, uncertainty: np.ndarray) -> None:
    shares, predicted, oracle = metrics.sparsification(error, uncertainty)
    axes.plot(100 * shares, 1e3 * predicted, color=_COLOURS[0], lw=1.8, label="dropped by predicted variance")
    axes.plot(100 * shares, 1e3 * oracle, color=_COLOURS[3], lw=1.5, label="dropped by the true error")
    axes.axhline(1e3 * predicted[0], color=FAINT, lw=1, ls="--", label="dropped at random")
    axes.set(xlabel="grasps dropped, %", ylabel="RMSE of the rest, mm", ylim=(0, None))
    axes.set_title(f"Translation: AUSE {metrics.ause(error, uncertainty):.2f} of random")
    axes.legend(fontsize=8)


def _error_over_deviation(axes: Axes, shift: np.ndarray, turn: np.ndarray, variance: np.ndarray) -> None:
    """RMSE in bins of equal number over the RMS predicted deviation: a line through the origin is perfect."""
    shift_std, turn_std = np.sqrt(variance[:, :3].sum(axis=1)), np.sqrt(variance[:, 3])
    for error, std, factor, colour, label in (
        (shift, shift_std, 1e3, _COLOURS[0], "translation, mm"),
        (turn, turn_std, 180 / np.pi, _COLOURS[1], "rotation, degrees"),
    ):
        bins = [piece for piece in np.array_split(np.argsort(std), _BINS) if len(piece)]
        x = [factor * np.sqrt((std[piece] ** 2).mean()) for piece in bins]
        y = [factor * np.sqrt((error[piece] ** 2).mean()) for piece in bins]
        axes.plot(x, y, color=colour, lw=1.2, marker="o", ms=4, label=label)
    low, high = (f(*axes.get_xlim(), *axes.get_ylim()) for f in (min, max))
    low = max(low, 0.3)
    axes.plot([low, high], [low, high], color=FAINT, lw=1, ls="--")
    axes.set(
        xscale="log", yscale="log", xlabel="predicted deviation", ylabel="RMSE in a twelfth of the grasps"
    )
    axes.set_title("Displacement: error over predicted deviation")
    axes.legend()


def draw_curves(history: list[EpochMetrics], report: dict[str, Any], path: Path) -> None:
    """Draw losses and validation metrics by epoch, beside trivial predictors.

    Args:
        history: Of all epochs, as `mskgrasp.learning.trainer.train` returns them.
        report: The final metrics as ``metrics.json`` holds them, with the trivial predictors' errors.
        path: The picture, PNG.
    """
    stages = [name for name in _TITLES if any(one.stage == name for one in history)]
    with saved_figure(path, 11.5, 3.0 * len(stages)) as figure:
        panels = figure.subplots(len(stages), 3)
        for line, name in zip(panels, stages, strict=True):
            rows = [one for one in history if one.stage == name]
            # A displacement network is compared by another loss than the one that trains it.
            held_out = "held-out parts, as one Gaussian" if name == "gdn" else "held-out parts"
            _curve(line[0], rows, "train_loss", "training (with noise and dropout)", FAINT)
            _curve(line[0], rows, "validation_loss", held_out, _COLOURS[0])
            line[0].set(title=f"{_TITLES[name]} loss", xlabel="epoch")
            line[0].legend(fontsize=8)
            if name != "gdn":
                _curve(line[1], rows, "auroc", "held-out parts", _COLOURS[0])
                line[1].axhline(0.5, color=FAINT, lw=1, ls="--", label="chance")
                line[1].set(title="Success: AUROC", xlabel="epoch", ylim=(0.3, 1.02))
                line[1].legend(fontsize=8, loc="lower right")
        gqn, gdn = report["gqn"], report["gdn"]
        bars = {
            "network": (gqn["brier"], _COLOURS[0]),
            "base rate": (gqn["brier_of_base_rate"], FAINT),
        }
        panels[0, 2].bar(
            list(bars), [v for v, _ in bars.values()], color=[c for _, c in bars.values()], width=0.5
        )
        panels[0, 2].set(title="Success: Brier score (lower is better)")
        for place, (value, _) in enumerate(bars.values()):
            panels[0, 2].text(place, value, f"{value:.3f}", ha="center", va="bottom")
        rows = [one for one in history if one.stage == "gdn"]
        for axes, key, unit, factor in (
            (panels[-1, 1], "translation_rmse", "mm", _MM),
            (panels[-1, 2], "rotation_rmse", "degrees", float(np.degrees(1.0))),
        ):
            _curve(axes, rows, key, "held-out parts", _COLOURS[0], factor)
            for style, other in (("--", "zero_displacement"), (":", "training_mean")):
                axes.axhline(
                    gdn[other][key] * factor, color=FAINT, lw=1.2, ls=style, label=other.replace("_", " ")
                )
            axes.set(title=f"{key.split('_')[0].capitalize()} RMSE, {unit}", xlabel="epoch")
            axes.set_ylim(bottom=0)
            axes.legend(fontsize=8)


def _curve(
    axes: Axes, rows: list[EpochMetrics], key: str, label: str, colour: str, factor: float = 1.0
) -> None:
    values = [getattr(one, key) * factor for one in rows]
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.plot([one.epoch for one in rows], values, color=colour, lw=1.8, label=label, marker="o", ms=3)
