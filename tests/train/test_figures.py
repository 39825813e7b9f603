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


def test_curves_of_a_run_without_variances_are_drawn(tmp_path):
    trivial = {"translation_rmse": 0.01, "rotation_rmse": 0.2}
    history = [
        EpochMetrics(stage="gqn", epoch=1, train_loss=0.6, validation_loss=0.5, auroc=0.8, seconds=1.0),
        EpochMetrics(stage="gdn", epoch=1, train_loss=4.0, validation_loss=3.0, **trivial, seconds=1.0),
    ]
    report = {
        "gqn": {"brier": 0.1, "brier_of_base_rate": 0.2},
        "gdn": trivial | {"zero_displacement": trivial, "training_mean": trivial},
    }
    draw_curves(history, report, tmp_path / "curves.png")
    assert (tmp_path / "curves.png").stat().st_size > 10_000


def test_uncertainty_of_a_network_is_drawn_against_its_errors(dataset, tmp_path, monkeypatch):
    samples = read_samples(dataset, PATCH.network)
    rows = torch.arange(len(samples))
    models = build_models(describe_networks(samples, rows, PATCH))
    kept = keep_figures(figures, monkeypatch)
    draw_uncertainty(models, samples, rows, tmp_path / "uncertainty.png")
    reliability, coverage, sparsification, deviation = kept[0].axes
    # The share that succeeded is that of the data, whatever an untrained network predicts.
    points = reliability.collections[0]
    sizes = np.array(points.get_sizes()) - 8
    succeeded = np.average(points.get_offsets()[:, 1], weights=sizes)
    assert succeeded == pytest.approx(float(samples.success.double().mean()), abs=1e-6)
    assert legend_labels(coverage) == ["x", "y", "z", "theta"]
    levels, covered = coverage.lines[1].get_data()
    assert levels[0] == 0.05 and levels[-1] == 0.95 and (np.diff(covered) >= 0).all()
    predicted, oracle = (line.get_ydata() for line in sparsification.lines[:2])
    assert predicted[0] == pytest.approx(oracle[0])  # nothing is dropped yet
    assert (oracle <= predicted + 1e-9).all() and oracle[-1] < oracle[0]
    assert len(deviation.lines[0].get_xdata()) == 12
    picture(tmp_path / "uncertainty.png")
