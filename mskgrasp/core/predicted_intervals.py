"""Central intervals of predicted displacements: their widths, and how much they hold."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator
from scipy.special import ndtri

from mskgrasp.core.config import Config
from mskgrasp.core.metrics import standardised_error

LEVELS = (*np.round(np.arange(0.05, 0.951, 0.05), 2).tolist(), 0.99)
"""Probabilities of the central intervals that a table of half widths lists."""
_GROUPS, _LEAST_IN_A_GROUP = 12, 200
"""Groups of predictions by their deviation: at most so many, each of at least so many."""
_Row = tuple[Annotated[float, Field(gt=0.0)], ...]
HalfWidth = Callable[[float, np.ndarray], float | np.ndarray]
"""Half width, in predicted standard deviations, of the central interval of a probability; from the
probability and the predicted variances (n, k), a number or (n, k)."""


def normal_half_width(level: float, variance: np.ndarray | None = None) -> float:
    """Half width of the central interval of probability ``level``, in standard deviations of a normal."""
    return float(ndtri((1 + level) / 2))


class IntervalTable(Config):
    """Half widths of central intervals, which depend on the predicted deviation.

    Errors are not normal: most parts do not rise in the hand, some do by 10 mm. The smaller the predicted
    deviation, the less a prediction errs in relation to it.
    """

    deviations: tuple[_Row, ...] = Field(min_length=1)
    """Medians (b, k) of the predicted standard deviations of b groups of predictions, metres and radians."""
    half_widths: tuple[tuple[_Row, ...], ...]
    """Half widths (b, `LEVELS`, k) of each group, in predicted standard deviations."""

    @model_validator(mode="after")
    def _wider_intervals_hold_more(self) -> Self:
        if len(self.half_widths) != len(self.deviations):
            raise ValueError(f"{len(self.deviations)} deviations, half widths of {len(self.half_widths)}")
        tables = (self.deviations, *self.half_widths)
        for group in self.half_widths:
            if len(group) != len(LEVELS):
                raise ValueError(f"half_widths has {len(group)} rows, {len(LEVELS)} are needed")
        if len({len(row) for table in tables for row in table}) > 1 or any(
            more < less
            for table in tables
            for one, next_ in pairwise(table)
            for less, more in zip(one, next_, strict=True)
        ):
            raise ValueError("deviations, half_widths: rows of one length, each no less than the one before")
        return self

    def half_width(self, level: float, variance: np.ndarray) -> np.ndarray:
        """Half widths (n, k) of the central interval of probability ``level``, in predicted deviations.

        Between the levels of the table the width is interpolated over that of a normal distribution, between
        its deviations the logarithm over the logarithm. Beyond the levels the ratio to a normal's width is
        kept, beyond the deviations the width.

        Args:
            level: Probability.
            variance: (n, k) predicted; of fewer components, the first.
        """
        normal, far = [normal_half_width(each) for each in LEVELS], 100.0
        known_widths = [0.0, *normal, far * normal[-1]]
        groups = [
            np.array([np.zeros(len(group[0])), *group, np.multiply(far, group[-1])])
            for group in self.half_widths
        ]
        width = normal_half_width(level)
        at_level = [[np.interp(width, known_widths, column) for column in group.T] for group in groups]
        known, logs = np.log(self.deviations), np.log(at_level)
        asked = np.log(np.asarray(variance, dtype=np.float64)) / 2
        found = [np.interp(x, xp, fp) for x, xp, fp in zip(asked.T, known.T, logs.T, strict=False)]
        return np.exp(np.stack(found, axis=1))


def measured_intervals(mean: np.ndarray, variance: np.ndarray, true: np.ndarray) -> IntervalTable:
    """Measure the intervals that hold these true values (n, k).

    The quantiles of |error| / deviation (normalised conformal prediction, Papadopoulos et al. 2008), in
    groups of similar deviation, as many in each; those of equal deviation are taken together.
    """
    error = np.abs(standardised_error(mean, variance, true))
    deviation = np.sqrt(np.asarray(variance, dtype=np.float64))
    n_groups = int(np.clip(len(error) // _LEAST_IN_A_GROUP, 1, _GROUPS))
    columns = [_measured(*column, n_groups) for column in zip(deviation.T, error.T, strict=True)]
    medians, widths = (np.stack(some, axis=-1) for some in zip(*columns, strict=True))
    return IntervalTable(
        deviations=tuple(tuple(row) for row in medians.tolist()),
        half_widths=tuple(tuple(tuple(row) for row in rows) for rows in widths.tolist()),
    )


def _measured(deviation: np.ndarray, error: np.ndarray, n_groups: int) -> tuple[np.ndarray, np.ndarray]:
    """Median deviations (b,) of groups of rows of one component, and their half widths (b, `LEVELS`)."""
    groups = np.array_split(np.argsort(deviation, kind="stable"), n_groups)
    medians = _rounded(np.array([np.median(deviation[group]) for group in groups]))
    alike = [np.concatenate([groups[k] for k in np.flatnonzero(medians == one)]) for one in medians]
    widths = np.array([np.quantile(error[group], LEVELS) for group in alike])
    return medians, _rounded(np.maximum(widths, 1e-6))


def _rounded(values: np.ndarray) -> np.ndarray:
    """To four digits: a table is a quarter of the description of a model."""
    return np.array([float(f"{value:.4g}") for value in values.ravel()]).reshape(values.shape)


def coverage(
    mean: np.ndarray,
    variance: np.ndarray,
    true: np.ndarray,
    level: float = 0.9,
    half_width: HalfWidth = normal_half_width,
) -> np.ndarray:
    """Share of true values inside the central interval of probability ``level``, per axis (k,)."""
    if not len(true):
        return np.full(np.shape(true)[1], np.nan)
    return (np.abs(standardised_error(mean, variance, true)) <= half_width(level, variance)).mean(axis=0)


def calibration_error(
    mean: np.ndarray, variance: np.ndarray, true: np.ndarray, half_width: HalfWidth = normal_half_width
) -> np.ndarray:
    """Mean difference of level and coverage of the central intervals of 5, 10, ... 95 %, per axis (k,)."""
    levels = np.linspace(0.05, 0.95, 19)
    covered = np.stack([coverage(mean, variance, true, level, half_width) for level in levels])
    return np.abs(covered - levels[:, None]).mean(axis=0)
