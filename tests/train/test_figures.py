"""Figures of a training."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mskgrasp.learning.grasp_models import build_models
from mskgrasp.learning.model_metrics import EpochMetrics
from mskgrasp.learning.samples import read_samples
from mskgrasp.learning.trainer import describe_networks
from mskgrasp.train import figures
from mskgrasp.train.figures import draw_curves, draw_uncertainty
from tests.figures import keep_figures, legend_labels, picture
from tests.learning.small import PATCH


def test_curves_of_a_run_without_variances_are_drawn_beside_the_trivial_predictors(tmp_path, monkeypatch):
    history = [
        EpochMetrics(stage="gqn", epoch=1, train_loss=0.6, validation_loss=0.5, auroc=0.8, seconds=1.0),
        EpochMetrics(stage="gqn", epoch=2, train_loss=0.4, validation_loss=0.45, auroc=0.9, seconds=1.0),
        EpochMetrics(
            stage="gdn",
            epoch=1,
            train_loss=4.0,
            validation_loss=3.0,
            translation_rmse=0.01,
            rotation_rmse=0.2,
            seconds=1.0,
        ),  # fmt: skip
    ]
    zero = {"translation_rmse": 0.012, "rotation_rmse": 0.3}
    mean = {"translation_rmse": 0.011, "rotation_rmse": 0.25}
    report = {
        "gqn": {"brier": 0.1, "brier_of_base_rate": 0.2},
        "gdn": {"zero_displacement": zero, "training_mean": mean},
    }
    kept = keep_figures(figures, monkeypatch)
    draw_curves(history, report, tmp_path / "curves.png")
    quality_loss, auroc, brier, loss, translation, rotation = kept[0].axes
    assert [list(line.get_ydata()) for line in quality_loss.lines] == [[0.6, 0.4], [0.5, 0.45]]
    assert list(auroc.lines[0].get_xdata()) == [1, 2] and list(auroc.lines[0].get_ydata()) == [0.8, 0.9]
    assert [bar.get_height() for bar in brier.patches] == [0.1, 0.2]
    assert [list(line.get_ydata()) for line in loss.lines] == [[4.0], [3.0]]
    assert legend_labels(translation) == ["held-out parts", "zero displacement", "training mean"]
    in_mm = [line.get_ydata()[0] for line in translation.lines]
    assert in_mm == pytest.approx([10, 12, 11])
    in_degrees = [line.get_ydata()[0] for line in rotation.lines]
    assert in_degrees == pytest.approx([11.459, 17.189, 14.324], abs=1e-3)
    picture(tmp_path / "curves.png")


@pytest.mark.parametrize(
    ("components", "changes"),
    [
        pytest.param(["x", "y", "z", "theta"], {}, marks=pytest.mark.slow),
        (["x", "y", "z", "theta", "swing_x", "swing_y"], {"swing": True, "mixture": 2}),
    ],
)
def test_uncertainty_of_a_network_is_drawn_against_its_errors(
    dataset, tmp_path, monkeypatch, components, changes
):
    config = PATCH.model_copy(update={"network": PATCH.network.model_copy(update=changes)})
    samples = read_samples(dataset, config.network)
    rows = torch.arange(len(samples))
    models = build_models(describe_networks(samples, rows, config))
    kept = keep_figures(figures, monkeypatch)
    draw_uncertainty(models, samples, rows, tmp_path / "uncertainty.png")
    reliability, coverage, sparsification, deviation = kept[0].axes
    # The share that succeeded is that of the data, whatever an untrained network predicts.
    points = reliability.collections[0]
    sizes = np.array(points.get_sizes()) - 8
    succeeded = np.average(points.get_offsets()[:, 1], weights=sizes)
    assert succeeded == pytest.approx(float(samples.success.double().mean()), abs=1e-6)
    assert legend_labels(coverage) == components
    levels, covered = coverage.lines[1].get_data()
    assert levels[0] == 0.05 and levels[-1] == 0.95 and (np.diff(covered) >= 0).all()
    predicted, oracle = (line.get_ydata() for line in sparsification.lines[:2])
    assert predicted[0] == pytest.approx(oracle[0])  # nothing is dropped yet
    assert (oracle <= predicted + 1e-9).all() and oracle[-1] < oracle[0]
    assert len(deviation.lines[0].get_xdata()) == 12
    picture(tmp_path / "uncertainty.png")
