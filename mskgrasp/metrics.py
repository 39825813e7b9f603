"""How good predictions are: numbers with a definition each, over numpy arrays."""

from __future__ import annotations

import numpy as np
from scipy.stats import norm, rankdata

from mskgrasp.geometry import wrap_angle


def translation_rmse(predicted: np.ndarray, true: np.ndarray) -> float:
    """sqrt(mean |predicted - true|^2) of the first three components, metres.

    Args:
        predicted: (n, 4) object displacements; the error is the distance, not its share an axis.
        true: (n, 4).
    """
    error = np.asarray(predicted, dtype=np.float64)[:, :3] - np.asarray(true, dtype=np.float64)[:, :3]
    return _root_mean((error**2).sum(axis=1))


def rotation_rmse(predicted: np.ndarray, true: np.ndarray) -> float:
    """sqrt(mean wrap(predicted - true)^2) of the angle, radians.

    Args:
        predicted: (n, 4) object displacements.
        true: (n, 4).
    """
    error = np.asarray(predicted, dtype=np.float64)[:, 3] - np.asarray(true, dtype=np.float64)[:, 3]
    return _root_mean(wrap_angle(error) ** 2)


def _root_mean(squares: np.ndarray) -> float:
    return float(np.sqrt(squares.mean())) if squares.size else float("nan")


def standardised_error(mean: np.ndarray, variance: np.ndarray, true: np.ndarray) -> np.ndarray:
    """(true - mean) / standard deviation, (n, 4), the angle's difference wrapped."""
    error = np.asarray(true, dtype=np.float64) - np.asarray(mean, dtype=np.float64)
    error[:, 3] = wrap_angle(error[:, 3])
    return error / np.sqrt(np.asarray(variance, dtype=np.float64))


def gaussian_nll(mean: np.ndarray, variance: np.ndarray, true: np.ndarray) -> float:
    """Mean negative log likelihood of true (n, 4) under independent Gaussians, nats, constant included.

    Units are metres and radians, so that good predictions have negative values.
    """
    variance = np.asarray(variance, dtype=np.float64)
    squared = standardised_error(mean, variance, true) ** 2
    terms = np.log(2 * np.pi * variance) + squared
    return float(terms.sum(axis=1).mean() / 2) if len(terms) else float("nan")


def coverage(mean: np.ndarray, variance: np.ndarray, true: np.ndarray, level: float = 0.9) -> np.ndarray:
    """Share of true values inside the central interval that should hold ``level`` of them, an axis (4,)."""
    if not len(true):
        return np.full(4, np.nan)
    half_width = norm.ppf((1 + level) / 2)
    return (np.abs(standardised_error(mean, variance, true)) <= half_width).mean(axis=0)


def brier(probability: np.ndarray, success: np.ndarray) -> float:
    """Mean (probability - success)^2; always saying the base rate b scores b (1 - b)."""
    return float(((np.asarray(probability, dtype=np.float64) - success) ** 2).mean())


def balanced_accuracy(probability: np.ndarray, success: np.ndarray, threshold: float = 0.5) -> float:
    """Mean of the shares of successes and of failures told right; NaN if either kind is missing."""
    told = np.asarray(probability) > threshold
    success = np.asarray(success, dtype=bool)
    if success.all() or not success.any():
        return float("nan")
    return float((told[success].mean() + (~told[~success]).mean()) / 2)


def auroc(score: np.ndarray, success: np.ndarray) -> float:
    """Probability that a success scores above a failure, ties counted half; NaN if a kind is missing."""
    success = np.asarray(success, dtype=bool)
    n_success, n_failure = int(success.sum()), int((~success).sum())
    if not n_success or not n_failure:
        return float("nan")
    ranks = rankdata(score)
    return float((ranks[success].sum() - n_success * (n_success + 1) / 2) / (n_success * n_failure))


def wilson_interval(n_success: int, n: int, level: float = 0.95) -> tuple[float, float]:
    """Confidence interval of a share (Wilson 1927): sensible for few trials and for shares near 0 and 1."""
    if n == 0:
        return 0.0, 1.0
    z = float(norm.ppf((1 + level) / 2))
    share = n_success / n
    middle = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * float(np.sqrt(share * (1 - share) / n + z * z / (4 * n * n)))
    return max(0.0, middle - half), min(1.0, middle + half)
