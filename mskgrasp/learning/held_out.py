"""Metrics of trained networks on held-out parts, compared with constant predictors, and their calibration."""

from __future__ import annotations

import numpy as np
import torch
from scipy.optimize import minimize
from scipy.special import logit

from mskgrasp.core import metrics
from mskgrasp.core.displacement_covariance import object_displacement_covariance, swing_squared
from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.grasp import TILT_LIMIT, to_object_displacement
from mskgrasp.core.predicted_intervals import (
    HalfWidth,
    calibration_error,
    coverage,
    measured_intervals,
    normal_half_width,
)
from mskgrasp.learning.grasp_models import ModelCalibration, Models
from mskgrasp.learning.model_metrics import (
    DisplacementMetrics,
    Interval,
    ModelMetrics,
    PredictionErrors,
    QualityMetrics,
    UncertaintyMetrics,
)
from mskgrasp.learning.samples import Samples

_CHUNK, _CHUNK_ON_A_GPU = 64, 4096
"""Samples in a batch: a CPU's cache is small, a GPU's kernels take long to start."""
AXES = ("x", "y", "z", "theta", "swing_x", "swing_y")
"""Predicted components; the last two by networks that predict the swing alone."""
_REPEATS = 200
"""Bootstrap repeats for the intervals of the scores, some of which sort."""
_RADIUS = 0.03
"""Radius of gyration of a typical part, metres: variance scores here use one for all parts."""
_LEAST_TO_SCALE = 50
"""Fewest successes from which a 90 % quantile is estimated."""
_LEAST_SLOPE = 0.01
"""Of the calibration of the quality, whose own odds have slope 1."""


def _chunk(models: Models) -> int:
    return _CHUNK_ON_A_GPU if models.device.type == "cuda" else _CHUNK


def predict_quality(models: Models, samples: Samples, rows: torch.Tensor) -> np.ndarray:
    """Predict probabilities of success (n,)."""
    pieces = [
        models.quality(
            samples.quality_patches_of(r, models.device, models.meta.network),
            samples.centre_grasp[r].to(models.device),
            samples.height[r].to(models.device),
        )
        for r in rows.split(_chunk(models))
    ]
    return torch.cat(pieces).cpu().double().numpy()


def predict_grasp_displacement(
    models: Models, samples: Samples, rows: torch.Tensor
) -> tuple[np.ndarray, np.ndarray]:
    """Predict mean and variance (n, k) of `Samples.targets`; without a variance it is NaN."""
    means, variances = [], []
    for r in rows.split(_chunk(models)):
        mean, variance = models.grasp_displacement(
            samples.displacement_patches_of(r, models.device),
            samples.centre_grasp[r].to(models.device),
            samples.height[r].to(models.device),
            samples.theta[r].to(models.device),
        )
        means.append(mean)
        variances.append(torch.full_like(mean, torch.nan) if variance is None else variance)
    return torch.cat(means).cpu().double().numpy(), torch.cat(variances).cpu().double().numpy()


def centroid_displacement(
    samples: Samples, rows: torch.Tensor, mean: np.ndarray, variance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Convert grasp displacements of some rows to displacements of the parts' true centroids.

    Args:
        samples: The dataset.
        rows: n rows.
        mean: (n, k) of the grasp displacement; columns after the fourth are not used.
        variance: (n, k) the same.

    Returns:
        Mean and variance (n, 4), the variance to first order.
    """
    origin_grasp = samples.origin_grasp[rows].double().numpy()
    covariance = object_displacement_covariance(mean[:, :4], variance[:, :4], origin_grasp)
    return to_object_displacement(mean, origin_grasp), np.diagonal(covariance, axis1=-2, axis2=-1)


def calibrate(models: Models, samples: Samples, rows: torch.Tensor) -> ModelCalibration:
    """Fit the corrections that make probabilities and 90 % intervals correct on these rows.

    The quality's log odds are stretched and shifted (Platt 1999); each variance is scaled by
    (q / 1.645)^2, q the 90 % quantile of |error| / deviation, so that heavy tails do not widen the whole
    distribution; intervals of any probability get the widths that hold as much, by the deviation. What the
    models were calibrated by before does not count.
    """
    models = models.uncalibrated()
    quality = predict_quality(models, samples, rows)
    slope, offset = _platt(logit(np.clip(quality, 1e-9, 1 - 1e-9)), samples.success[rows].numpy())
    scale, intervals = (), None
    held = rows[samples.success[rows]]
    mean, variance = predict_grasp_displacement(models, samples, held)
    if np.isfinite(variance).all() and len(held) >= _LEAST_TO_SCALE:
        target = samples.targets(held, models.meta.network).double().numpy()
        error = np.abs(metrics.standardised_error(mean, variance, target))
        deviation = np.quantile(error, 0.9, axis=0) / normal_half_width(0.9)
        scale = tuple(np.maximum(deviation**2, 1e-6))
        intervals = measured_intervals(mean, variance * scale, target)
    return ModelCalibration(
        quality_slope=slope, quality_offset=offset, variance_scale=scale, intervals=intervals
    )


def _platt(odds: np.ndarray, success: np.ndarray) -> tuple[float, float]:
    """Fit slope and offset of the log odds by maximum likelihood; Platt's targets avoid 0 and 1.

    The slope is `_LEAST_SLOPE` at least: without one a planner could not tell grasps apart.
    """
    n_success, n_failure = int(success.sum()), int((~success).sum())
    target = np.where(success, (n_success + 1) / (n_success + 2), 1 / (n_failure + 2))

    def loss(values: np.ndarray) -> float:
        z = max(np.exp(values[0]), _LEAST_SLOPE) * odds + values[1]
        return float((np.logaddexp(0.0, z) - target * z).mean())

    found = minimize(loss, np.zeros(2), method="Nelder-Mead").x
    return max(float(np.exp(found[0])), _LEAST_SLOPE), float(found[1])


def measure_models(
    models: Models, samples: Samples, training_rows: torch.Tensor, rows: torch.Tensor
) -> ModelMetrics:
    """Compute all metrics of both networks on some rows."""
    return ModelMetrics(
        gqn=quality_metrics(models, samples, rows),
        gdn=displacement_metrics(models, samples, training_rows, rows),
    )


def quality_metrics(models: Models, samples: Samples, rows: torch.Tensor) -> QualityMetrics:
    """Compute balanced accuracy, AUROC and Brier score of the GQN, and the base rate's Brier score.

    A grasp counts as predicted to succeed if its probability exceeds the training data's base rate: with
    balanced data, one half. Intervals are 95 % bootstrap intervals over parts.
    """
    success = samples.success[rows].numpy()
    probability = predict_quality(models, samples, rows)
    base_rate = models.meta.normalisation.base_rate
    each = _by_part(samples, rows, np.column_stack([probability, success]))
    intervals = {
        "balanced_accuracy": lambda v: metrics.balanced_accuracy(v[:, 0], v[:, 1], base_rate),
        "auroc": lambda v: metrics.auroc(v[:, 0], v[:, 1]),
        "brier": lambda v: metrics.brier(v[:, 0], v[:, 1]),
    }
    return QualityMetrics(
        intervals={
            name: metrics.bootstrap_interval(each, statistic, repeats=_REPEATS)
            for name, statistic in intervals.items()
        },
        reliability=metrics.reliability(probability, success).tolist(),
        n=len(success),
        base_rate=float(success.mean()),
        balanced_accuracy=metrics.balanced_accuracy(probability, success, base_rate),
        auroc=metrics.auroc(probability, success),
        brier=metrics.brier(probability, success),
        brier_of_base_rate=metrics.brier(np.full(len(success), base_rate), success),
    )


def displacement_metrics(
    models: Models, samples: Samples, training_rows: torch.Tensor, rows: torch.Tensor
) -> DisplacementMetrics:
    """Compute errors of the GDN on successful grasps, and of predicting zero and the training mean.

    RMSE is over the displacement of the true centroid, likelihood and coverage over the grasp displacement.
    """
    training_rows = training_rows[samples.success[training_rows]]
    rows = rows[samples.success[rows]]
    mean, variance = predict_grasp_displacement(models, samples, rows)
    training = samples.targets(training_rows, models.meta.network).double().numpy()
    floor = 1e-12
    constants = (
        (np.zeros(training.shape[1]), np.maximum((training**2).mean(axis=0), floor)),
        (training.mean(axis=0), np.maximum(training.var(axis=0), floor)),
    )
    zero, training_mean = (
        prediction_errors(
            samples, rows, np.tile(constant, (len(rows), 1)), np.tile(constant_variance, (len(rows), 1))
        )
        for constant, constant_variance in constants
    )
    return DisplacementMetrics(
        n=len(rows),
        errors=prediction_errors(samples, rows, mean, variance, models.meta.calibration.half_width),
        intervals=_rmse_intervals(samples, rows, mean, variance),
        uncertainty=_uncertainty_metrics(samples, rows, mean, variance, models.meta.calibration.half_width),
        zero_displacement=zero,
        training_mean=training_mean,
    )


def _rmse_intervals(
    samples: Samples, rows: torch.Tensor, mean: np.ndarray, variance: np.ndarray
) -> dict[str, Interval]:
    """Compute 95 % intervals over parts of the RMSE of translation and rotation."""
    shift, turn, _ = centroid_errors(samples, rows, mean, variance)
    return {
        f"{name}_rmse": metrics.bootstrap_interval(_by_part(samples, rows, error**2), _root_mean)
        for name, error in (("translation", shift), ("rotation", turn))
    }


def centroid_errors(
    samples: Samples, rows: torch.Tensor, mean: np.ndarray, variance: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the errors of predicted grasp displacements over the displacement of the parts' true centroids.

    Args:
        samples: The dataset.
        rows: n rows of successful grasps.
        mean: (n, k) of the grasp displacement.
        variance: (n, k) the same; NaN where none is predicted.

    Returns:
        Distances (n,), metres, angles (n,), radians, not negative, and the predicted variances (n, 4).
    """
    displacement = samples.displacement[rows].double().numpy()
    predicted, expected = centroid_displacement(samples, rows, mean, variance)
    shift = np.linalg.norm(predicted[:, :3] - displacement[:, :3], axis=1)
    return shift, np.abs(wrap_angle(predicted[:, 3] - displacement[:, 3])), expected


def variance_score(mean: np.ndarray, variance: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Compute the expected squared distance (n,) of a part's points from where they are predicted, m^2.

    Args:
        mean: (n, k) predicted grasp displacement and, with k = 6, swing.
        variance: (n, k) the same.
        expected: (n, 4) variances of the displacement of the centroid (`centroid_errors`).
    """
    return expected[:, :3].sum(axis=1) + _RADIUS**2 * (expected[:, 3] + swing_squared(mean, variance))


def _uncertainty_metrics(
    samples: Samples,
    rows: torch.Tensor,
    mean: np.ndarray,
    variance: np.ndarray,
    half_width: HalfWidth,
) -> UncertaintyMetrics | None:
    """Compute metrics of the predicted variances; None without variances or rows."""
    if not np.isfinite(variance).all() or not len(rows):
        return None
    shift, turn, expected = centroid_errors(samples, rows, mean, variance)
    target = true_outcomes(samples, rows, mean)
    score = variance_score(mean, variance, expected)
    tilted = samples.swing[rows].norm(dim=1).numpy() > TILT_LIMIT
    axes = {
        "crps": metrics.crps(mean, variance, target),
        "calibration_error": calibration_error(mean, variance, target, half_width),
        "sharpness": np.sqrt(variance).mean(axis=0),
        "rmse": np.sqrt((metrics.standardised_error(mean, variance, target) ** 2 * variance).mean(axis=0)),
    } | {
        f"coverage_{level}": coverage(mean, variance, target, level / 100, half_width)
        for level in (50, 80, 90, 95)
    }
    return UncertaintyMetrics(
        axes={name: dict(zip(AXES, map(float, values), strict=False)) for name, values in axes.items()},
        ause_translation=metrics.ause(shift, expected[:, :3].sum(axis=1)),
        ause_rotation=metrics.ause(turn, expected[:, 3]),
        least_uncertain={
            f"{share:.0%}": _errors_of_least(score, share, shift, turn, tilted) for share in (0.03, 0.1, 0.3)
        },
    )


def _errors_of_least(
    score: np.ndarray, share: float, shift: np.ndarray, turn: np.ndarray, tilted: np.ndarray
) -> list[float]:
    """Compute RMSE of translation and rotation, and the share tilted, over the samples of least score."""
    kept = np.argsort(score, kind="stable")[: max(1, round(share * len(score)))]
    return [*(_root_mean(values[kept] ** 2) for values in (shift, turn)), float(tilted[kept].mean())]


def true_outcomes(samples: Samples, rows: torch.Tensor, predicted: np.ndarray) -> np.ndarray:
    """Get true grasp displacements (n, 4), or with swing (n, 6), as many columns as are predicted.

    Args:
        samples: The dataset.
        rows: Rows of attempts that lifted the part.
        predicted: (n, 4) or (n, 6) predicted means.
    """
    both = torch.cat([samples.grasp_displacement[rows], samples.swing[rows]], dim=1)
    return both[:, : predicted.shape[1]].double().numpy()


def _root_mean(squared: np.ndarray) -> float:
    return float(np.sqrt(squared.mean()))


def _by_part(samples: Samples, rows: torch.Tensor, values: np.ndarray) -> list[np.ndarray]:
    """Group values by the part of their row."""
    part = samples.part[rows].numpy()
    return [values[part == number] for number in np.unique(part)]


def prediction_errors(
    samples: Samples,
    rows: torch.Tensor,
    mean: np.ndarray,
    variance: np.ndarray,
    half_width: HalfWidth = normal_half_width,
) -> PredictionErrors:
    """Compute RMSE over the displacement of the true centroid, likelihood and coverage over the grasp's."""
    predicted, _ = centroid_displacement(samples, rows, mean, variance)
    displacement = samples.displacement[rows].double().numpy()
    target = true_outcomes(samples, rows, mean)
    covered = coverage(mean, variance, target, half_width=half_width)
    known = bool(np.isfinite(variance).all())
    return PredictionErrors(
        translation_rmse=metrics.translation_rmse(predicted, displacement),
        rotation_rmse=metrics.rotation_rmse(predicted, displacement),
        nll=metrics.gaussian_nll(mean, variance, target) if known else None,
        coverage_90=dict(zip(AXES, covered.tolist(), strict=False)) if known else None,
    )
