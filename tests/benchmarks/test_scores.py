"""Scores of predictions whose errors are known."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mskgrasp.core.grasp import to_grasp_displacement
from mskgrasp.learning.samples import Samples
from tests.benchmarks.choice import Predictions
from tests.benchmarks.score_details import detail_table, details_of
from tests.benchmarks.scores import change_table, changes, errors_of, score_table, scores_of

N_PARTS, EACH = 20, 40


@pytest.fixture(scope="module")
def samples() -> Samples:
    """Grasps of 20 parts, three in four of which succeed, and displace the part by millimetres."""
    rng = np.random.default_rng(0)
    n = N_PARTS * EACH
    origin, moved = rng.normal(0, 0.01, (n, 3)), rng.normal(0, [0.003, 0.003, 0.001, 0.05], (n, 4))
    success = torch.arange(n) % 4 > 0
    tensor = lambda values: torch.from_numpy(np.asarray(values)).float()  # noqa: E731
    return Samples(
        patches=torch.zeros((n, 1, 2, 2), dtype=torch.int16), object_patches=None, theta=torch.zeros(n),
        centre_grasp=tensor(origin), origin_grasp=tensor(origin), quat_grasp_obj=torch.zeros((n, 4)),
        height=torch.full((n,), 0.02), success=success, displacement=tensor(moved),
        grasp_displacement=tensor(to_grasp_displacement(moved, origin)), swing=torch.zeros((n, 2)),
        part=torch.arange(n) // EACH, planned=torch.zeros(n, dtype=torch.bool),
        parts=tuple(f"part_{k}" for k in range(N_PARTS)), skipped={},
        fingerprint="made",
    )  # fmt: skip


def predictions(
    samples: Samples, std: np.ndarray, seed: int, quality: np.ndarray | None = None
) -> Predictions:
    """Predictions that miss each axis by normal errors of these deviations (m, 4), and say so."""
    held = samples.success
    target = samples.grasp_displacement[held].double().numpy()
    error = std * np.random.default_rng(seed).normal(size=target.shape)
    return Predictions(
        quality=np.zeros(0) if quality is None else quality,
        mean=target + error,
        variance=std**2 * np.ones_like(target),
    )


def stds(samples: Samples, z: np.ndarray) -> np.ndarray:
    """Deviations (m, 4): of z as given, of the others next to none."""
    m = int(samples.success.sum())
    return np.stack([np.full(m, 1e-9), np.full(m, 1e-9), np.broadcast_to(z, m), np.full(m, 1e-9)], axis=1)


def test_rmse_is_that_of_the_errors_and_the_most_confident_are_those_of_least_variance(samples):
    m = int(samples.success.sum())
    z = np.where(np.arange(m) % 10 == 0, 0.001, 0.004)
    seeds = [predictions(samples, stds(samples, z), seed) for seed in range(3)]
    scores = scores_of(samples, torch.arange(len(samples)), seeds, 0.5)
    assert (scores.n, scores.successes, scores.parts) == (N_PARTS * EACH, m, N_PARTS)
    expected = np.sqrt(0.1 * 0.001**2 + 0.9 * 0.004**2)
    assert scores.translation.mean == pytest.approx(expected, rel=0.05)
    low, high = scores.translation.interval
    assert low < expected < high and high - low < 0.2 * expected
    assert 0 < scores.translation.deviation < 0.1 * expected
    assert scores.confident_translation is not None
    assert scores.confident_translation.mean == pytest.approx(0.001, rel=0.2)
    assert scores.rotation.mean < 1e-6
    assert scores.balanced_accuracy is None and scores.quality_ece is None
    assert scores.coverage is not None
    assert scores.coverage["z"] == pytest.approx([0.5, 0.8, 0.9, 0.95], abs=0.04)


def test_quality_is_scored_against_the_base_rate(samples):
    success = samples.success.numpy()
    probability = np.where(success, 0.8, 0.6)
    seeds = [predictions(samples, stds(samples, np.array(0.001)), 0, probability)]
    rows = torch.arange(len(samples))
    scores = scores_of(samples, rows, seeds, 0.7)
    assert scores.balanced_accuracy is not None and scores.balanced_accuracy.mean == 1.0
    assert scores.quality_ece == pytest.approx(0.75 * 0.2 + 0.25 * 0.6)
    details = details_of(samples, rows, seeds)
    assert details["AUROC"] == 1.0 and details["Brier"] == pytest.approx(0.75 * 0.04 + 0.25 * 0.36)
    assert details["most confident 10%: tilted"] == 0.0
    assert detail_table({"ours": details}).rows[0][1] == "1.000"


def test_changes_are_paired_over_parts(samples):
    """Half the error on the same grasps is a change of -50 %, however much the parts differ."""
    m = int(samples.success.sum())
    hard = np.where(np.arange(m) < m // 2, 0.02, 0.001)
    whole = predictions(samples, stds(samples, hard), 0)
    target = samples.grasp_displacement[samples.success].double().numpy()
    half = Predictions(quality=np.zeros(0), mean=target + (whole.mean - target) / 2, variance=whole.variance)
    rows = torch.arange(len(samples))
    found = changes(errors_of(samples, rows, [half]), errors_of(samples, rows, [whole]))
    assert found["translation"].mean == pytest.approx(-0.5, abs=1e-3)
    assert found["translation"].interval == pytest.approx((-0.5, -0.5), abs=1e-3)
    assert found["confident_translation"].mean == pytest.approx(-0.5, abs=1e-2)
    (row,) = change_table({"half": found}).rows
    assert row[:2] == ("half", "-50.0% [-50.0, -50.0]")


def test_without_variances_nothing_is_said_of_confidence(samples):
    one = predictions(samples, stds(samples, np.array(0.001)), 0)
    mean_only = Predictions(quality=one.quality, mean=one.mean, variance=np.full_like(one.mean, np.nan))
    rows = torch.arange(len(samples))
    scores = scores_of(samples, rows, [mean_only], 0.5)
    assert scores.confident_translation is None and scores.coverage is None
    assert scores.translation == scores_of(samples, rows, [one], 0.5).translation
    found = changes(errors_of(samples, rows, [mean_only]), errors_of(samples, rows, [one]))
    assert set(found) == {"translation", "rotation"}
    assert score_table({"mean": scores}).header == ["", "successes", "mm", "degrees"]
    (row, _) = score_table({"mean": scores, "both": scores_of(samples, rows, [one], 0.5)}).rows
    assert row[-2:] == [None, None]


def test_predictions_of_some_attempts_are_those_of_their_rows(samples):
    quality = np.linspace(0, 1, len(samples))
    one = predictions(samples, stds(samples, np.array(0.001)), 0, quality)
    success, kept = samples.success.numpy(), samples.part.numpy() == 3
    some = one.only(kept, success)
    np.testing.assert_array_equal(some.quality, quality[kept])
    np.testing.assert_array_equal(some.mean, one.mean[samples.part[samples.success].numpy() == 3])
    other = one.only(~kept, success)
    assert len((some + other).mean) == len(one.mean)
