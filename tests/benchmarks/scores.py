"""Scores of predictions on groups of attempts, with intervals over parts, and their tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import torch

from mskgrasp.core import metrics
from mskgrasp.core.predicted_intervals import coverage
from mskgrasp.learning.held_out import AXES, centroid_errors, variance_score
from mskgrasp.learning.samples import Samples
from mskgrasp.runtime.console_table import Table
from tests.benchmarks.choice import Predictions

LEVELS = (50, 80, 90, 95)
"""Probabilities of the central intervals whose coverage is measured, percent."""
MOST_CONFIDENT = 0.1
"""Share of the successful attempts of least predicted variance."""
_REPEATS = 200
"""Draws of a bootstrap."""


@dataclass(frozen=True, kw_only=True)
class Value:
    """A figure: the mean over seeds, its 95 % interval over parts (None of one), its deviation over seeds."""

    mean: float
    interval: tuple[float, float] | None
    deviation: float


@dataclass(frozen=True, kw_only=True)
class Scores:
    """Scores of a choice on a group of attempts; None where it predicts no quality or no variance.

    Attributes:
        n: Attempts.
        successes: Those that lifted the part.
        parts: Number of parts with a success.
        balanced_accuracy: Of the quality, against the training data's share of successes.
        quality_ece: Expected calibration error of the quality.
        translation: RMSE over all successes, metres.
        rotation: The same, radians.
        confident_translation: RMSE over the most confident tenth of them, metres.
        confident_rotation: The same, radians.
        coverage: Share of grasp displacements inside the intervals of `LEVELS`, by axis.
    """

    n: int
    successes: int
    parts: int
    balanced_accuracy: Value | None
    quality_ece: float | None
    translation: Value
    rotation: Value
    confident_translation: Value | None
    confident_rotation: Value | None
    coverage: dict[str, list[float]] | None

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Errors of the predictions of several seeds, by part.

    Attributes:
        squared: By part, (m_i, seeds, 2): squared distance, m^2, and squared angle, rad^2.
        score: By part, (m_i, seeds): variance score, m^2; None without variances.
    """

    squared: list[np.ndarray]
    score: list[np.ndarray] | None

    def columns(self) -> list[np.ndarray]:
        """By part (m_i, 3, seeds): both squared errors and the score, 0 without variances."""
        scores = self.score or [np.zeros(one.shape[:2]) for one in self.squared]
        both = zip(self.squared, scores, strict=True)
        return [np.stack([one[..., 0], one[..., 1], score], axis=1) for one, score in both]


def errors_of(samples: Samples, rows: torch.Tensor, seeds: Sequence[Predictions]) -> Errors:
    """Compute the errors over the displacement of the centroid of the successes among some rows."""
    rows = rows[samples.success[rows]]
    squared, scores = [], []
    for one in seeds:
        shift, turn, expected = centroid_errors(samples, rows, one.mean, one.variance)
        squared.append(np.column_stack([shift**2, turn**2]))
        scores.append(variance_score(one.mean, one.variance, expected))
    part = samples.part[rows].numpy()
    where = [np.flatnonzero(part == number) for number in np.unique(part)]
    each, score = np.stack(squared, axis=1), np.stack(scores, axis=1)
    known = bool(np.isfinite(score).all())
    return Errors(
        squared=[each[here] for here in where], score=[score[here] for here in where] if known else None
    )


def _rmse(column: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda values: np.sqrt(values[:, column].mean(axis=0))


def _confident_rmse(column: int) -> Callable[[np.ndarray], np.ndarray]:
    def over_least(values: np.ndarray) -> np.ndarray:
        kept = max(1, round(MOST_CONFIDENT * len(values)))
        least = np.argsort(values[:, 2], axis=0, kind="stable")[:kept]
        return np.sqrt(np.take_along_axis(values[:, column], least, axis=0).mean(axis=0))

    return over_least


STATISTICS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "translation": _rmse(0),
    "rotation": _rmse(1),
    "confident_translation": _confident_rmse(0),
    "confident_rotation": _confident_rmse(1),
}
"""Functions of `Errors.columns`, joined over parts, that give a value a seed."""


def _value(values: Sequence[np.ndarray], statistic: Callable[[np.ndarray], np.ndarray]) -> Value:
    each = statistic(np.concatenate(values))
    ends = metrics.bootstrap_interval(values, lambda v: float(statistic(v).mean()), repeats=_REPEATS)
    return Value(
        mean=float(each.mean()),
        interval=ends if np.isfinite(ends).all() else None,
        deviation=float(each.std()),
    )


def scores_of(samples: Samples, rows: torch.Tensor, seeds: Sequence[Predictions], base_rate: float) -> Scores:
    """Score the predictions of several seeds for some rows.

    Args:
        samples: The dataset.
        rows: The group's n rows.
        seeds: Predictions of each seed for them.
        base_rate: Share of successes of the training data: a grasp of higher quality counts as a success.
    """
    errors = errors_of(samples, rows, seeds)
    columns = errors.columns()
    certain = errors.score is not None
    values = {
        name: _value(columns, statistic) if certain or not name.startswith("confident") else None
        for name, statistic in STATISTICS.items()
    }
    accuracy, ece = _quality(samples, rows, seeds, base_rate)
    assert values["translation"] is not None and values["rotation"] is not None
    return Scores(
        n=len(rows),
        successes=int(samples.success[rows].sum()),
        parts=len(columns),
        balanced_accuracy=accuracy,
        quality_ece=ece,
        translation=values["translation"],
        rotation=values["rotation"],
        confident_translation=values["confident_translation"],
        confident_rotation=values["confident_rotation"],
        coverage=_coverage(samples, rows, seeds) if certain else None,
    )


def _quality(
    samples: Samples, rows: torch.Tensor, seeds: Sequence[Predictions], base_rate: float
) -> tuple[Value | None, float | None]:
    if not len(seeds[0].quality):
        return None, None
    success, part = samples.success[rows].numpy(), samples.part[rows].numpy()
    columns = np.column_stack([success, *(one.quality for one in seeds)])

    def accuracy(values: np.ndarray) -> np.ndarray:
        each = values[:, 1:].T
        return np.array([metrics.balanced_accuracy(one, values[:, 0], base_rate) for one in each])

    ece = [metrics.expected_calibration_error(one.quality, success) for one in seeds]
    return _value([columns[part == k] for k in np.unique(part)], accuracy), float(np.mean(ece))


def _coverage(samples: Samples, rows: torch.Tensor, seeds: Sequence[Predictions]) -> dict[str, list[float]]:
    rows = rows[samples.success[rows]]
    target = samples.grasp_displacement[rows].double().numpy()
    covered = np.mean(
        [
            [
                coverage(one.mean[:, :4], one.variance[:, :4], target, level / 100, one.half_width)
                for level in LEVELS
            ]
            for one in seeds
        ],
        axis=0,
    )
    return {axis: values.tolist() for axis, values in zip(AXES, covered.T, strict=False)}


def changes(one: Errors, reference: Errors) -> dict[str, Value]:
    """Change of each RMSE relative to that of a reference on the same grasps, with paired intervals.

    The parts that are drawn are the same for both; values are shares, negative where the error is lower.
    """
    n = one.squared[0].shape[1]
    values = [np.concatenate(pair, axis=2) for pair in zip(one.columns(), reference.columns(), strict=True)]

    def change(statistic: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
        # The mean over seeds of both, so that seeds need not be paired.
        return lambda v: np.array(
            [statistic(v[..., :n]).mean() / max(float(statistic(v[..., n:]).mean()), 1e-12) - 1]
        )

    certain = one.score is not None and reference.score is not None
    return {
        name: _value(values, change(statistic))
        for name, statistic in STATISTICS.items()
        if certain or not name.startswith("confident")
    }


def score_table(scores: dict[str, Scores], *, bold: str = "", caption: str = "") -> Table:
    """The table of accuracy and errors of one group, a row a choice, without columns that none has."""
    header = (
        "", "successes", "accuracy", "ECE", "mm", "degrees",
        f"most confident {MOST_CONFIDENT:.0%}: mm", "degrees",
    )  # fmt: skip
    rows = [
        (
            f"**{name}**" if name == bold else name,
            one.successes,
            _cell(one.balanced_accuracy, 100, "%"),
            None if one.quality_ece is None else f"{one.quality_ece:.3f}",
            _cell(one.translation, 1e3),
            _cell(one.rotation, float(np.degrees(1))),
            _cell(one.confident_translation, 1e3),
            _cell(one.confident_rotation, float(np.degrees(1))),
        )
        for name, one in scores.items()
    ]
    known = [k for k in range(len(header)) if any(row[k] is not None for row in rows)]
    return Table(
        header=[header[k] for k in known], rows=[[row[k] for k in known] for row in rows], caption=caption
    )


def coverage_table(scores: dict[str, Scores]) -> Table:
    """The table of coverages of one group, a row a choice with variances."""
    axes = ("x", "y", "z", "turn")
    levels = " / ".join(map(str, LEVELS))
    rows = [
        (name, *(" / ".join(f"{100 * share:.0f}" for share in values) for values in one.coverage.values()))
        for name, one in scores.items()
        if one.coverage is not None
    ]
    return Table(header=(f"inside the {levels} % interval", *(f"{axis}, %" for axis in axes)), rows=rows)


def change_table(found: dict[str, dict[str, Value]], caption: str = "") -> Table:
    """The table of changes relative to a reference, a row a choice."""
    rows = [
        (name, *(_cell(values.get(statistic), 100, "%", signed=True) for statistic in STATISTICS))
        for name, values in found.items()
    ]
    header = (
        "", "translation", "rotation",
        f"most confident {MOST_CONFIDENT:.0%}: translation", "rotation",
    )  # fmt: skip
    return Table(header=header, rows=rows, caption=caption)


def _cell(value: Value | None, factor: float, unit: str = "", *, signed: bool = False) -> str | None:
    if value is None:
        return None
    sign = "+" if signed else ""
    digits = 1 if factor == 100 else 2
    text = f"{factor * value.mean:{sign}.{digits}f}{unit}"
    if value.interval is None:
        return text
    low, high = (f"{factor * bound:{sign}.{digits}f}" for bound in value.interval)
    return f"{text} [{low}, {high}]"
