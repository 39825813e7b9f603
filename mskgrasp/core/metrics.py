"""Metrics of predictions and their uncertainty, and confidence intervals, on numpy arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import root_scalar
from scipy.special import betainc, gammaln, ndtr, ndtri, stdtrit

from mskgrasp.core.geometry import wrap_angle

_CORRELATIONS, _MEANS = 64, 200
"""Nodes over the correlation of alike trials and over their mean, of `share_interval`."""


def translation_rmse(predicted: np.ndarray, true: np.ndarray) -> float:
    """sqrt(mean |predicted - true|^2) of the first three components, metres.

    Args:
        predicted: (n, 4) object displacements; the error is the distance, not the error per axis.
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
    """(true - mean) / standard deviation, (n, k), the difference of the angle (column 3) wrapped."""
    error = np.asarray(true, dtype=np.float64) - np.asarray(mean, dtype=np.float64)
    error[:, 3] = wrap_angle(error[:, 3])
    return error / np.sqrt(np.asarray(variance, dtype=np.float64))


def gaussian_nll(mean: np.ndarray, variance: np.ndarray, true: np.ndarray) -> float:
    """Mean negative log likelihood of true (n, k) under independent Gaussians, nats, constant included.

    Units are metres and radians, so that good predictions have negative values.
    """
    variance = np.asarray(variance, dtype=np.float64)
    squared = standardised_error(mean, variance, true) ** 2
    terms = np.log(2 * np.pi * variance) + squared
    return float(terms.sum(axis=1).mean() / 2) if len(terms) else float("nan")


def crps(mean: np.ndarray, variance: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Continuous ranked probability score of Gaussians, per axis (k,), in the axes' units; 0 is perfect.

    Gneiting and Raftery (2007), equation 21: sigma (z (2 Phi(z) - 1) + 2 phi(z) - 1 / sqrt(pi)).
    """
    z = standardised_error(mean, variance, true)
    score = z * (2 * ndtr(z) - 1) + 2 * np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi) - 1 / np.sqrt(np.pi)
    return (np.sqrt(variance) * score).mean(axis=0) if len(z) else np.full(np.shape(true)[1], np.nan)


def sparsification(error: np.ndarray, uncertainty: np.ndarray, steps: int = 50) -> tuple[np.ndarray, ...]:
    """RMSE of the remaining samples when the most uncertain ones, or the worst ones, are dropped.

    Args:
        error: (n,) absolute errors.
        uncertainty: (n,) predicted; only its order matters.
        steps: Number of dropped shares, from 0 to 1 - 1 / steps.

    Returns:
        Shares (steps,), RMSE in the order of uncertainty, RMSE in the order of the errors (the oracle).
    """
    shares = np.arange(steps) / steps
    squared = np.asarray(error, dtype=np.float64) ** 2
    curves = []
    for order in (np.argsort(uncertainty, kind="stable"), np.argsort(squared, kind="stable")):
        kept = np.cumsum(squared[order]) / np.arange(1, len(squared) + 1)
        last = np.maximum(1, np.round((1 - shares) * len(squared)).astype(int)) - 1
        curves.append(np.sqrt(kept[last]))
    return shares, curves[0], curves[1]


def ause(error: np.ndarray, uncertainty: np.ndarray) -> float:
    """Area under the sparsification error, relative to a random order: 0 is perfect, 1 is useless.

    Ilg et al. 2018 (arXiv 1802.07095), divided by the area of a random order.
    """
    if len(error) < 2:
        return float("nan")
    _, predicted, oracle = sparsification(error, uncertainty)
    whole = float((predicted[0] - oracle).sum())
    if whole == 0:  # equal errors have no order
        return float("nan")
    return float((predicted - oracle).sum()) / whole


def reliability(probability: np.ndarray, success: np.ndarray, bins: int = 10) -> np.ndarray:
    """Rows (k, 3) of mean predicted probability, share of successes and count of the non-empty bins."""
    probability = np.asarray(probability, dtype=np.float64)
    which = np.minimum((probability * bins).astype(int), bins - 1)
    rows = [
        (probability[which == k].mean(), np.asarray(success)[which == k].mean(), (which == k).sum())
        for k in range(bins)
        if (which == k).any()
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def expected_calibration_error(probability: np.ndarray, success: np.ndarray, bins: int = 10) -> float:
    """Mean |predicted probability - share of successes| over bins, by their counts (Naeini et al. 2015)."""
    return calibration_gap(reliability(probability, success, bins))


def calibration_gap(rows: np.ndarray) -> float:
    """The expected calibration error of rows (k, 3) of `reliability`; NaN where there is none."""
    if not len(rows):
        return float("nan")
    return float(np.average(np.abs(rows[:, 0] - rows[:, 1]), weights=rows[:, 2]))


def bootstrap_interval(
    values: Sequence[np.ndarray],
    statistic: Callable[[np.ndarray], float],
    *,
    level: float = 0.95,
    repeats: int = 1000,
    seed: int = 0,
) -> tuple[float, float]:
    """Bootstrap confidence interval of a statistic; whole objects are resampled with replacement.

    Grasps of one part are correlated; resampling single grasps would make intervals too narrow. So do the
    plain percentiles of the draws of few objects; those taken are expanded as a t interval is against a
    normal one (Hesterberg, The American Statistician 69, 2015, "expanded percentile interval"). An RMSE over
    few objects of which some are far worse than others is still covered less often than the level says.

    Args:
        values: One array (n_i, ...) of samples for each object; one without samples is left out.
        statistic: Function of the concatenated samples of the drawn objects.
        level: Confidence level.
        repeats: Number of draws.
        seed: Seed of the draws.

    Returns:
        The interval; NaN, NaN of fewer than two objects, which do not show how objects differ, and where the
        statistic is NaN in every draw.
    """
    values = [one for one in values if len(one)]
    if len(values) < 2:
        return float("nan"), float("nan")
    rng = np.random.default_rng(seed)
    found = [
        statistic(np.concatenate([values[i] for i in rng.integers(len(values), size=len(values))]))
        for _ in range(repeats)
    ]
    n = len(values)
    tail = float(ndtr(np.sqrt(n / (n - 1)) * stdtrit(n - 1, (1 - level) / 2)))
    if np.isnan(found).all():
        return float("nan"), float("nan")
    low, high = np.nanquantile(found, [tail, 1 - tail])
    return float(low), float(high)


def rms_interval(errors: Sequence[np.ndarray], level: float = 0.95) -> tuple[float, float] | None:
    """Confidence interval of the root mean square of errors over clusters of alike ones, such as parts.

    Student's t interval of its logarithm, whose standard error is that of the jackknife over whole clusters
    (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, chapter 11). Where some clusters are far
    worse than others it covers the root mean square more often than intervals by bootstrap do, BCa among
    them: ``python -m tests.benchmarks.interval_coverage``.

    Args:
        errors: (n_i,) errors of each cluster; one without errors is left out.
        level: Confidence level.

    Returns:
        The interval; None of fewer than three clusters, and where a single one has all errors: they bound
        nothing.
    """
    errors = [one for one in errors if len(one)]
    k = len(errors)
    if k < 3:
        return None
    squares = np.array([float((np.asarray(one, dtype=np.float64) ** 2).sum()) for one in errors])
    counts = np.array([len(one) for one in errors], dtype=np.float64)
    total = float(squares.sum() / counts.sum())
    if total == 0.0:
        return 0.0, 0.0
    # Summed, not subtracted from the sum: beside a far greater one small errors would be rounded away.
    left_out = (1 - np.eye(k)) @ squares / (counts.sum() - counts)
    if not (left_out > 0).all():
        return None
    logs = np.log(left_out) / 2
    deviation = float(np.sqrt((k - 1) / k * ((logs - logs.mean()) ** 2).sum()))
    factor = float(np.exp(stdtrit(k - 1, (1 + level) / 2) * deviation))
    return float(np.sqrt(total)) / factor, float(np.sqrt(total)) * factor


def brier(probability: np.ndarray, success: np.ndarray) -> float:
    """Mean (probability - success)^2; always predicting the base rate b scores b (1 - b)."""
    return float(((np.asarray(probability, dtype=np.float64) - success) ** 2).mean())


def balanced_accuracy(probability: np.ndarray, success: np.ndarray, threshold: float = 0.5) -> float:
    """Mean of the true positive and true negative rates; NaN if either class is missing."""
    positive = np.asarray(probability) > threshold
    success = np.asarray(success, dtype=bool)
    if success.all() or not success.any():
        return float("nan")
    return float((positive[success].mean() + (~positive[~success]).mean()) / 2)


def auroc(score: np.ndarray, success: np.ndarray) -> float:
    """Probability that a success scores above a failure, ties counted half; NaN if a class is missing."""
    success = np.asarray(success, dtype=bool)
    n_success, n_failure = int(success.sum()), int((~success).sum())
    if not n_success or not n_failure:
        return float("nan")
    from scipy.stats import rankdata  # takes most of a second to import

    ranks = rankdata(score)
    return float((ranks[success].sum() - n_success * (n_success + 1) / 2) / (n_success * n_failure))


def wilson_interval(n_success: int, n: int, level: float = 0.95) -> tuple[float, float]:
    """Confidence interval of a share (Wilson 1927); valid for few trials and for shares near 0 and 1."""
    return _wilson(n_success / n if n else 0.0, n, level)


def _wilson(share: float, n: float, level: float) -> tuple[float, float]:
    """Wilson's interval of a share of n trials; n need not be whole."""
    if n == 0:
        return 0.0, 1.0
    z = float(ndtri((1 + level) / 2))
    middle = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * float(np.sqrt(share * (1 - share) / n + z * z / (4 * n * n)))
    return max(0.0, middle - half), min(1.0, middle + half)


def share_interval(n_success: np.ndarray, n: np.ndarray, level: float = 0.95) -> tuple[float, float]:
    """Confidence interval of a share over clusters of alike trials, such as those at one part.

    Trials of a cluster are beta-binomial: any two have the same correlation. It is not known, least of all
    where every cluster has the same share, since a hundred trials that lift twenty parts may tell no more
    than twenty do. So the interval is averaged over the correlation's posterior, from a uniform prior. Given
    the correlation, it is Jeffreys's (Brown, Cai and DasGupta, Statistical Science 16, 2001) with the number
    of trials divided by their design effect (Kish, Survey Sampling, 1965). How often it covers the truth:
    ``python -m tests.benchmarks.interval_coverage``. Where clusters of middling rates have more trials than
    others, as in a training dataset, it is wider than it need be.

    Args:
        n_success: (k,) successes of each cluster.
        n: (k,) its trials; a cluster without any is left out.
        level: Confidence level.

    Returns:
        The interval over all clusters that might be drawn; 0, 1 of no trial. That of a single cluster, which
        cannot show how clusters differ, is Wilson's interval of this cluster.
    """
    won, tried = np.asarray(n_success, dtype=np.float64), np.asarray(n, dtype=np.float64)
    won, tried = won[tried > 0], tried[tried > 0]
    total = float(tried.sum())
    share = float(won.sum()) / total if total else 0.0
    if len(won) < 2:
        return _wilson(share, total, level)
    nodes, weights = np.polynomial.legendre.leggauss(_CORRELATIONS)
    root = (nodes + 1) / 2  # of the correlation: many clusters that differ little need nodes near zero
    correlation, weights = root**2, root * weights
    # Jeffreys's prior of the mean is uniform in this angle.
    mean = np.sin((np.arange(_MEANS) + 0.5) / _MEANS * np.pi / 2)[:, None] ** 2
    whole = 1 / correlation - 1
    log_likelihood = np.zeros((_MEANS, _CORRELATIONS))
    for prior, seen, sign in (
        (mean * whole, won, 1),
        ((1 - mean) * whole, tried - won, 1),
        (whole, tried, -1),
    ):
        for k, times in zip(*np.unique(seen[seen > 0], return_counts=True), strict=True):
            log_likelihood += sign * times * (gammaln(prior + k) - gammaln(prior))
    posterior = np.exp(log_likelihood - log_likelihood.max()).sum(axis=0) * weights
    posterior /= posterior.sum()
    effective = total**2 / (tried * (1 + (tried - 1) * correlation[:, None])).sum(axis=1)

    def end(probability: float) -> float:
        def below(value: float) -> float:
            cumulative = betainc(share * effective + 0.5, (1 - share) * effective + 0.5, value)
            return float(posterior @ cumulative) - probability

        return float(root_scalar(below, bracket=(0.0, 1.0)).root)

    low, high = (end(tail) for tail in ((1 - level) / 2, (1 + level) / 2))
    return min(low, share), max(high, share)
