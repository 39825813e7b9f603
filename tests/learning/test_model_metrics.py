"""What is stored of a network's metrics."""

import json

from mskgrasp.learning.model_metrics import (
    DisplacementMetrics,
    EpochMetrics,
    ModelMetrics,
    PredictionErrors,
    QualityMetrics,
    UncertaintyMetrics,
)

QUALITY = QualityMetrics(
    intervals={"auroc": (0.7, 0.9)},
    reliability=[[0.1, 0.2, 30.0]],
    n=30,
    base_rate=0.3,
    balanced_accuracy=0.8,
    auroc=0.85,
    brier=0.1,
    brier_of_base_rate=0.2,
)
ERRORS = PredictionErrors(translation_rmse=0.001, rotation_rmse=0.1, nll=-9.0, coverage_90={"x": 0.9})
CONSTANT = PredictionErrors(translation_rmse=0.004, rotation_rmse=0.3, nll=None, coverage_90=None)
UNCERTAINTY = UncertaintyMetrics(
    axes={"crps": {"x": 1e-4}}, ause_translation=0.3, ause_rotation=0.4, least_uncertain={"3%": [1e-4, 0.01]}
)


def displacement(uncertainty: UncertaintyMetrics | None) -> DisplacementMetrics:
    return DisplacementMetrics(
        n=20,
        errors=ERRORS,
        intervals={"translation_rmse": (0.0009, 0.0011)},
        uncertainty=uncertainty,
        zero_displacement=CONSTANT,
        training_mean=CONSTANT,
    )


def test_an_epoch_is_stored_without_the_metrics_of_the_other_network():
    losses = dict(epoch=3, train_loss=0.5, validation_loss=0.6)
    quality = EpochMetrics(stage="gqn", **losses, auroc=0.7, seconds=1.2)
    assert list(quality.to_json()) == ["stage", "epoch", "train_loss", "validation_loss", "auroc", "seconds"]
    moved = EpochMetrics(stage="gdn", **losses, translation_rmse=0.001, rotation_rmse=0.1, seconds=1.2)
    assert list(moved.to_json())[-3:] == ["translation_rmse", "rotation_rmse", "seconds"]
    assert EpochMetrics(**json.loads(json.dumps(moved.to_json()))) == moved


def test_the_networks_errors_and_uncertainty_are_stored_beside_the_constants():
    stored = json.loads(json.dumps(ModelMetrics(gqn=QUALITY, gdn=displacement(UNCERTAINTY)).to_json()))
    assert stored["gqn"]["auroc"] == 0.85 and stored["gqn"]["intervals"] == {"auroc": [0.7, 0.9]}
    assert list(stored["gdn"]) == [
        "n", "translation_rmse", "rotation_rmse", "nll", "coverage_90", "intervals", "axes",
        "ause_translation", "ause_rotation", "least_uncertain", "zero_displacement", "training_mean",
    ]  # fmt: skip
    assert stored["gdn"]["coverage_90"] == {"x": 0.9}
    assert stored["gdn"]["training_mean"] == {
        "translation_rmse": 0.004, "rotation_rmse": 0.3, "nll": None, "coverage_90": None
    }  # fmt: skip


def test_a_network_without_variances_stores_no_uncertainty():
    stored = displacement(None).to_json()
    assert "axes" not in stored and stored["translation_rmse"] == 0.001
