"""Metrics of networks: of an epoch of training, and on held-out parts, as logs and models store them."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

Interval = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class EpochMetrics:
    """Losses and validation metrics of one epoch of one network.

    Attributes:
        stage: The network: ``gqn`` or ``gdn``.
        epoch: Number of the epoch, from 1.
        train_loss: Mean loss of the training batches.
        validation_loss: Loss on the validation parts; of ``gdn`` that of one Gaussian with the prediction's
            mean and variance, averaged over its views, whatever loss trains.
        auroc: Of the predicted qualities; None for ``gdn``.
        translation_rmse: Of the predicted displacements, metres; of ``gdn`` alone.
        rotation_rmse: The same, radians.
        seconds: Time taken.
    """

    stage: str
    epoch: int
    train_loss: float
    validation_loss: float
    auroc: float | None = None
    translation_rmse: float | None = None
    rotation_rmse: float | None = None
    seconds: float

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values, without those of the other network."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True, kw_only=True)
class QualityMetrics:
    """Metrics of the GQN.

    Attributes:
        intervals: 95 % bootstrap intervals over parts, by the metric's name.
        reliability: Mean predicted probability, share of successes and count of each bin.
        n: Number of grasps.
        base_rate: Share of them that succeeded.
        balanced_accuracy: Mean of the accuracies over successes and over failures.
        auroc: Area under the ROC curve.
        brier: Brier score.
        brier_of_base_rate: That of always predicting the training data's base rate.
    """

    intervals: dict[str, Interval]
    reliability: list[list[float]]
    n: int
    base_rate: float
    balanced_accuracy: float
    auroc: float
    brier: float
    brier_of_base_rate: float

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class PredictionErrors:
    """Errors of predicted displacements.

    Attributes:
        translation_rmse: Over the displacement of the true centroid, metres.
        rotation_rmse: The same, radians.
        nll: Negative log likelihood of the grasp displacement; None without variances.
        coverage_90: Share of grasp displacements inside the central 90 % interval, by axis; None likewise.
    """

    translation_rmse: float
    rotation_rmse: float
    nll: float | None
    coverage_90: dict[str, float] | None

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class UncertaintyMetrics:
    """Metrics of predicted variances.

    Attributes:
        axes: CRPS, calibration error, sharpness, RMSE and coverages of the grasp displacement, and of the
            swing where it is predicted, by axis.
        ause_translation: Area under the sparsification error, as a share of random order's.
        ause_rotation: The same.
        least_uncertain: RMSE of translation, metres, and rotation, radians, and share of tilted parts,
            over the shares of least variance score.
    """

    axes: dict[str, dict[str, float]]
    ause_translation: float
    ause_rotation: float
    least_uncertain: dict[str, list[float]]

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class DisplacementMetrics:
    """Metrics of the GDN on successful grasps, beside constant predictions.

    Attributes:
        n: Number of grasps.
        errors: Of the network.
        intervals: 95 % bootstrap intervals over parts of its RMSE, by the metric's name.
        uncertainty: Of its variances; None where it predicts none.
        zero_displacement: Errors of predicting that nothing moves.
        training_mean: Errors of predicting the training data's mean.
    """

    n: int
    errors: PredictionErrors
    intervals: dict[str, Interval]
    uncertainty: UncertaintyMetrics | None
    zero_displacement: PredictionErrors
    training_mean: PredictionErrors

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values, with the network's errors and uncertainty beside the others."""
        return {
            "n": self.n,
            **self.errors.to_json(),
            "intervals": self.intervals,
            **(self.uncertainty.to_json() if self.uncertainty else {}),
            "zero_displacement": self.zero_displacement.to_json(),
            "training_mean": self.training_mean.to_json(),
        }


@dataclass(frozen=True, kw_only=True)
class ModelMetrics:
    """Metrics of both networks on the same grasps.

    Attributes:
        gqn: Of the quality network.
        gdn: Of the displacement network.
    """

    gqn: QualityMetrics
    gdn: DisplacementMetrics

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values, as ``metrics.json`` and ``model.json`` hold them."""
        return {"gqn": self.gqn.to_json(), "gdn": self.gdn.to_json()}
