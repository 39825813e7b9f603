"""Metrics and calibration, on networks that learned nothing: what they predict is known."""

import dataclasses
import math

import numpy as np
import pytest
import torch

from mskgrasp.core import predicted_intervals
from mskgrasp.learning import held_out
from mskgrasp.learning.grasp_models import ModelCalibration, Models, build_models
from mskgrasp.learning.sides import split
from mskgrasp.learning.trainer import describe_networks
from tests.learning.small import PATCH

CLOSING = ("x", "y", "theta")
"""A box does not rise in the jaw of the synthetic scenes."""


def constant_models(samples, *, variance_factor: float = 1.0, logit: float = 0.0) -> Models:
    """Networks that predict one mean, one variance and one probability for all grasps."""
    meta = describe_networks(samples, split(samples, PATCH).training, PATCH)
    models = build_models(meta)
    with torch.no_grad():
        for network in (models.gqn, models.gdn):
            for parameter in network.parameters():
                parameter.zero_()
        models.gqn.head[-1].bias[1] = logit
        models.gdn.variance_head[-1].bias.fill_(math.log(variance_factor))
    return models


@pytest.fixture(scope="module")
def halves(samples):
    """A random half of the rows to calibrate on, and the other half."""
    order = torch.randperm(len(samples), generator=torch.Generator().manual_seed(0))
    return order[::2], order[1::2]


def with_calibration(models: Models, found: ModelCalibration) -> Models:
    return dataclasses.replace(models, meta=models.meta.model_copy(update={"calibration": found}))


@pytest.mark.parametrize(("factor", "before"), [(0.01, (0.0, 0.45)), (100.0, (0.995, 1.0))])
def test_calibrated_intervals_hold_their_share_of_rows_that_they_were_not_scaled_on(
    samples, halves, factor, before
):
    models = constant_models(samples, variance_factor=factor)
    scaled, others = halves
    found = held_out.calibrate(models, samples, scaled)
    calibrated = with_calibration(models, found)
    assert held_out.calibrate(calibrated, samples, scaled) == found  # the corrections before do not count

    def coverage(models):
        report = held_out.displacement_metrics(models, samples, scaled, others)
        assert report.n > 80
        return [report.errors.coverage_90[name] for name in CLOSING]

    assert all(before[0] <= share <= before[1] for share in coverage(models))
    # Some 100 rows on either side: three standard deviations of the difference are 12 %.
    assert all(0.78 <= share <= 1.0 for share in coverage(calibrated))
    assert sum(coverage(calibrated)) / 3 == pytest.approx(0.9, abs=0.06)


@pytest.mark.parametrize("logit", [-3.0, 3.0])
def test_a_calibrated_quality_agrees_with_the_share_that_succeeds_in_other_rows(samples, halves, logit):
    models = constant_models(samples, logit=logit)
    scaled, others = halves
    calibrated = with_calibration(models, held_out.calibrate(models, samples, scaled))
    true = float(samples.success[others].double().mean())
    assert abs(held_out.predict_quality(models, samples, others).mean() - true) > 0.25
    assert held_out.predict_quality(calibrated, samples, others).mean() == pytest.approx(true, abs=0.08)
    first, second = (held_out.quality_metrics(each, samples, others).brier for each in (models, calibrated))
    assert second < first - 0.05


def test_calibrated_intervals_of_every_probability_hold_that_share_of_other_rows(samples, halves):
    models = constant_models(samples, variance_factor=25.0)
    scaled, others = halves
    calibrated = with_calibration(models, held_out.calibrate(models, samples, scaled))
    held = others[samples.success[others]]
    mean, variance = held_out.predict_grasp_displacement(calibrated, samples, held)
    target = samples.targets(held, calibrated.meta.network).double().numpy()
    half_width = calibrated.meta.calibration.half_width
    for level in (0.5, 0.8, 0.9, 0.95):
        covered = predicted_intervals.coverage(mean, variance, target, level, half_width)
        # Some 100 rows on either side; z does not vary at all.
        assert np.allclose(covered[[0, 1, 3]], level, atol=3.5 * np.sqrt(2 * level * (1 - level) / 100))
        reported = held_out.displacement_metrics(calibrated, samples, scaled, others).uncertainty
        assert reported is not None
        found = list(reported.axes[f"coverage_{round(100 * level)}"].values())
        np.testing.assert_allclose(found, covered)


def test_too_few_successes_leave_the_variances_alone(samples, halves):
    models = constant_models(samples, variance_factor=100.0)
    held = halves[0][samples.success[halves[0]]][:40]
    failed = halves[0][~samples.success[halves[0]]][:40]
    assert held_out.calibrate(models, samples, torch.cat([held, failed])).variance_scale == ()


def test_errors_of_a_constant_prediction_are_those_of_the_constant(samples, halves):
    """The network that predicts the training mean has the errors of the comparison of that name."""
    models = constant_models(samples)
    with torch.no_grad():
        training = samples.grasp_displacement[halves[0][samples.success[halves[0]]]].double()
        models.gdn.target_mean.copy_(training.mean(dim=0))
    report = held_out.displacement_metrics(models, samples, *halves)
    for name in ("translation_rmse", "rotation_rmse"):
        found = getattr(report.errors, name)
        assert found == pytest.approx(getattr(report.training_mean, name), rel=1e-5)
        low, high = report.intervals[name]
        assert low < found < high
    moved = samples.displacement[halves[1][samples.success[halves[1]]]].double().numpy()
    assert report.zero_displacement.translation_rmse == pytest.approx(
        float(np.sqrt((moved[:, :3] ** 2).sum(axis=1).mean()))
    )


def test_a_known_motion_has_no_error_and_deviations_of_the_centroid(samples, halves):
    rows = halves[1][samples.success[halves[1]]]
    known = samples.grasp_displacement[rows].double().numpy()
    errors = held_out.prediction_errors(samples, rows, known, np.full_like(known, 1e-6))
    assert errors.translation_rmse < 1e-6 and errors.rotation_rmse < 1e-6
    turns = np.tile([0.0, 0.0, 0.0, 1e-4], (len(rows), 1))
    _, variance = held_out.centroid_displacement(samples, rows, np.zeros_like(turns), turns)
    x, y, _ = samples.origin_grasp[rows].double().numpy().T
    np.testing.assert_allclose(variance, 1e-4 * np.stack([y**2, x**2, 0 * x, 0 * x + 1], axis=1), atol=1e-12)


def test_a_constant_quality_ranks_nothing_and_has_the_brier_score_worked_out_by_hand(samples, halves):
    rows = halves[1]
    report = held_out.quality_metrics(constant_models(samples), samples, rows)
    share = float(samples.success[rows].double().mean())
    rate = constant_models(samples).meta.normalisation.base_rate
    assert report.auroc == pytest.approx(0.5) and report.base_rate == pytest.approx(share)
    by_hand = share * (1 - rate) ** 2 + (1 - share) * rate**2
    assert report.brier == pytest.approx(by_hand, rel=1e-5)
    assert report.brier_of_base_rate == pytest.approx(by_hand)


def test_a_quality_that_ranks_the_wrong_way_round_is_flattened_but_keeps_its_order():
    odds, success = np.tile([-2.0, 2.0], 50), np.tile([True, False], 50)
    slope, offset = held_out._platt(odds, success)
    assert slope == pytest.approx(0.01) and abs(offset) < 0.05
    slope, _ = held_out._platt(odds, np.tile([False, True, False, False], 25))
    assert 0.05 < slope < 1.5
