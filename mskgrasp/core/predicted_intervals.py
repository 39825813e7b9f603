"""Central intervals of predicted displacements: their widths, and how much they hold."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.special import ndtri

from mskgrasp.core.metrics import standardised_error

LEVELS = (*np.round(np.arange(0.05, 0.951, 0.05), 2).tolist(), 0.99)
"""Probabilities of the central intervals that a table of half widths lists."""


def normal_half_width(level: float) -> float:
    """Half width of the central interval of probability ``level``, in standard deviations of a normal."""
    return float(ndtri((1 + level) / 2))


def measured_half_widths(mean: np.ndarray, variance: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Half widths (`LEVELS`, k), in predicted deviations, of intervals that hold these true (n, k).

    The quantiles of |error| / deviation: normalised conformal prediction (Papadopoulos et al. 2008).
    """
    error = np.abs(standardised_error(mean, variance, true))
    return np.quantile(error, LEVELS, axis=0)


def half_width_of(table: np.ndarray, level: float) -> np.ndarray:
    """Half widths (k,) of the central interval of probability ``level``, from a table of them.

    Between the levels of the table the ratio to a normal's half width is interpolated; beyond, it is kept.

    Args:
        table: (`LEVELS`, k) in standard deviations.
        level: Probability.
    """
    normal = np.array([normal_half_width(each) for each in LEVELS])
    ratio = np.asarray(table, dtype=np.float64) / normal[:, None]
    width = normal_half_width(level)
    return width * np.array([np.interp(width, normal, column) for column in ratio.T])


HalfWidth = Callable[[float], float | np.ndarray]
"""Half width, or one a component (k,), of the central interval of a probability, in standard deviations."""


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
    return (np.abs(standardised_error(mean, variance, true)) <= half_width(level)).mean(axis=0)


def calibration_error(
    mean: np.ndarray, variance: np.ndarray, true: np.ndarray, half_width: HalfWidth = normal_half_width
) -> np.ndarray:
    """Mean difference of level and coverage of the central intervals of 5, 10, ... 95 %, per axis (k,)."""
    levels = np.linspace(0.05, 0.95, 19)
    covered = np.stack([coverage(mean, variance, true, level, half_width) for level in levels])
    return np.abs(covered - levels[:, None]).mean(axis=0)
