import numpy as np
import pytest
import torch
from scipy.stats import beta, binomtest, mannwhitneyu, norm

from mskgrasp.core import metrics
from mskgrasp.core.metrics import (
    auroc,
    balanced_accuracy,
    brier,
    gaussian_nll,
    rotation_rmse,
    share_interval,
    translation_rmse,
    wilson_interval,
)


def test_translation_error_is_a_distance_and_rotation_error_wraps():
    true = np.zeros((2, 4))
    predicted = np.array([[3.0, 4.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]])
    assert translation_rmse(predicted, true) == pytest.approx(np.sqrt(25 / 2))
    true[:, 3], predicted[:, 3] = np.pi - 0.1, -np.pi + 0.1
    assert rotation_rmse(predicted, true) == pytest.approx(0.2)


def test_likelihood_agrees_with_torch():
    rng = np.random.default_rng(0)
    mean, true, variance = rng.normal(size=(9, 4)), rng.normal(size=(9, 4)), rng.uniform(0.5, 2, (9, 4))
    mean[:, 3] = true[:, 3] = 0.0
    normal = torch.distributions.Normal(torch.from_numpy(mean), torch.from_numpy(variance).sqrt())
    expected = -normal.log_prob(torch.from_numpy(true)).sum(dim=1).mean()
    assert gaussian_nll(mean, variance, true) == pytest.approx(float(expected))


def test_auroc_is_the_mann_whitney_statistic_with_ties():
    rng = np.random.default_rng(0)
    score, success = rng.integers(0, 6, 200).astype(float), rng.random(200) < 0.3
    expected = mannwhitneyu(score[success], score[~success]).statistic / (success.sum() * (~success).sum())
    assert auroc(score, success) == pytest.approx(expected)
    assert auroc(np.array([0.1, 0.9]), np.array([False, True])) == 1.0
    assert np.isnan(auroc(np.array([0.1, 0.9]), np.array([True, True])))


def test_brier_of_the_base_rate_is_its_variance_and_accuracy_is_balanced():
    success = np.array([True] + [False] * 3)
    assert brier(np.full(4, 0.25), success) == pytest.approx(0.25 * 0.75)
    assert balanced_accuracy(np.zeros(4), success) == 0.5
    assert balanced_accuracy(np.array([0.9, 0.1, 0.1, 0.9]), success) == pytest.approx((1 + 2 / 3) / 2)


@pytest.mark.parametrize(("k", "n"), [(0, 10), (10, 10), (3, 20), (95, 100)])
def test_wilson_interval_agrees_with_scipy(k, n):
    expected = binomtest(k, n).proportion_ci(method="wilson")
    assert wilson_interval(k, n) == pytest.approx((expected.low, expected.high), abs=1e-9)


def test_no_trial_tells_nothing():
    assert wilson_interval(0, 0) == (0.0, 1.0)
    for k in range(4):
        assert share_interval(np.zeros(k), np.zeros(k)) == (0.0, 1.0)


def test_a_cluster_without_trials_changes_no_interval():
    won, tried = np.array([3, 5, 1]), np.array([4, 5, 6])
    assert share_interval(np.append(won, 0), np.append(tried, 0)) == share_interval(won, tried)
    assert share_interval(np.array([7, 0]), np.array([9, 0])) == wilson_interval(7, 9)
    errors = [np.array([1e-3, 2e-3]), np.array([4e-3]), np.array([3e-3, 1e-3])]
    for found in (metrics.rms_interval, lambda given: metrics.bootstrap_interval(given, np.mean, repeats=50)):
        assert found([*errors, np.zeros(0)]) == found(errors)
    assert metrics.rms_interval([np.zeros(0)] * 4) is None


def test_clusters_that_are_all_or_nothing_count_as_one_trial_each():
    low, high = share_interval(np.repeat([20, 0], 10), np.full(20, 20))
    assert (low, high) == pytest.approx(beta.ppf([0.025, 0.975], 10.5, 10.5), abs=0.02)
    assert high == pytest.approx(1 - low)


def test_single_trials_of_clusters_have_jeffreys_interval_and_a_single_cluster_wilsons():
    expected = beta.ppf([0.025, 0.975], 4.5, 2.5)
    assert share_interval(np.array([1, 0, 1, 1, 1, 0]), np.ones(6)) == pytest.approx(expected, abs=1e-9)
    assert share_interval(np.array([7]), np.array([9])) == wilson_interval(7, 9)


def test_the_ends_do_not_depend_on_the_nodes_and_hold_the_share_of_clusters_of_any_size(monkeypatch):
    rng = np.random.default_rng(0)
    for k, n, alike in ((60, 200, 0.02), (300, 100, 0.04), (130, 30, 0.3)):
        a, b = 0.6 * (1 - alike) / alike, 0.4 * (1 - alike) / alike
        won, tried = rng.binomial(n, rng.beta(a, b, k)), np.full(k, n)
        usual = share_interval(won, tried)
        with monkeypatch.context() as finer:
            finer.setattr(metrics, "_CORRELATIONS", 2 * metrics._CORRELATIONS)
            finer.setattr(metrics, "_MEANS", 4 * metrics._MEANS)
            assert usual == pytest.approx(share_interval(won, tried), abs=0.01 * (usual[1] - usual[0]))
    for won, tried in (([1, 0], [10_000, 10_000]), ([10_000, 0], [10_000, 1])):
        low, high = share_interval(np.array(won), np.array(tried))
        assert low <= sum(won) / sum(tried) <= high


def test_where_all_clusters_are_alike_they_may_count_as_trials_or_as_one_trial_each():
    low, high = share_interval(np.full(20, 5), np.full(20, 5))
    assert beta.ppf(0.025, 20.5, 0.5) < low < beta.ppf(0.025, 100.5, 0.5) and high == 1.0
    mirrored = share_interval(np.zeros(20), np.full(20, 5))
    assert mirrored == pytest.approx((0.0, 1 - low))


@pytest.mark.parametrize(
    ("n_clusters", "n_each", "share", "alike"),
    [(5, 5, 0.8, 0.3), (12, 2, 0.8, 0.3), (60, 7, 0.8, 0.3), (20, 30, 0.99, 0.6), (85, 35, 0.98, 0.3)],
)
def test_a_share_over_clusters_is_in_its_interval_as_often_as_stated(n_clusters, n_each, share, alike):
    rng = np.random.default_rng(0)
    # The correlation of trials of one cluster is `alike`.
    a, b = share * (1 - alike) / alike, (1 - share) * (1 - alike) / alike
    won = rng.binomial(n_each, rng.beta(a, b, (300, n_clusters)))
    tried = np.full(n_clusters, n_each)
    intervals = np.array([share_interval(row, tried) for row in won])
    naive = np.array([wilson_interval(int(row.sum()), int(tried.sum())) for row in won])
    covered, without = (((one[:, 0] <= share) & (share <= one[:, 1])).mean() for one in (intervals, naive))
    # Of 300 the share is known to 1.3 %; three of that.
    assert covered > 0.95 - 0.038 and without < covered
    if n_clusters >= 60:  # and they are not wider than they need to be
        deviation = np.sqrt(share * (1 - share) * (1 + (n_each - 1) * alike) / (n_clusters * n_each))
        assert np.median(intervals[:, 1] - intervals[:, 0]) == pytest.approx(2 * 1.96 * deviation, rel=0.15)


def test_crps_is_the_integral_of_its_definition():
    mean, std, true = 0.3, 0.7, 1.1
    x = np.linspace(-8, 8, 200_001)
    expected = np.trapezoid((norm.cdf(x, mean, std) - (x >= true)) ** 2, x)
    found = metrics.crps(np.full((1, 4), mean), np.full((1, 4), std**2), np.full((1, 4), true))
    assert np.allclose(found, expected, atol=1e-4)


def test_ause_is_none_of_an_order_that_knows_and_one_of_an_order_that_does_not():
    rng = np.random.default_rng(0)
    error = np.abs(rng.normal(0, 1, 20_000))
    assert metrics.ause(error, error) == pytest.approx(0.0)
    assert metrics.ause(error, rng.random(20_000)) == pytest.approx(1.0, abs=0.05)
    assert metrics.ause(error, -error) > 1.5
    assert np.isnan(metrics.ause(np.ones(5), np.arange(5.0)))  # equal errors have no order


def test_reliability_counts_what_happened_at_each_probability():
    rows = metrics.reliability(np.array([0.05, 0.05, 0.95, 1.0]), np.array([0, 1, 1, 1]))
    assert rows.tolist() == [[0.05, 0.5, 2.0], [0.975, 1.0, 2.0]]


def test_bootstrap_draws_whole_objects():
    # Within an object all is equal: drawn sample by sample, the interval would be ten times narrower.
    objects = [np.full(100, float(value)) for value in np.random.default_rng(0).normal(0, 1, 25)]
    low, high = metrics.bootstrap_interval(objects, lambda drawn: float(drawn.mean()))
    assert 0.5 < high - low < 1.1 and low < np.mean(objects) < high


def test_one_object_does_not_tell_how_objects_differ_and_two_do():
    assert np.isnan(metrics.bootstrap_interval([np.arange(9.0)], np.mean)).all()
    low, high = metrics.bootstrap_interval([np.zeros(2), np.ones(2)], np.mean)
    assert low <= 0.0 < 1.0 <= high  # one in four draws has either alone
    assert np.isnan(metrics.bootstrap_interval([np.zeros(2), np.ones(2)], lambda _: float("nan"))).all()


def test_the_mean_of_few_objects_is_in_its_interval_nearly_as_often_as_stated():
    rng = np.random.default_rng(0)
    drawn = rng.normal(size=(300, 5, 1))  # plain percentiles cover four in five
    found = [
        metrics.bootstrap_interval(list(one), lambda values: float(values.mean()), repeats=300)
        for one in drawn
    ]
    assert np.mean([low <= 0.0 <= high for low, high in found]) > 0.87


def test_the_interval_of_an_rms_is_over_clusters_and_wide_where_they_differ():
    alike = [np.array([1.0, 2.0])] * 8
    assert metrics.rms_interval(alike) == pytest.approx((np.sqrt(2.5),) * 2)
    low, high = interval([*alike, np.array([9.0, 9.0])])
    assert low < 2.0 and high > 9.0
    assert metrics.rms_interval([np.zeros(2), np.zeros(3), np.zeros(2)]) == (0.0, 0.0)
    # All that is known is in one cluster, or nearly: nothing is bounded.
    assert metrics.rms_interval([np.zeros(2), np.zeros(2), np.array([3.0, 3.0])]) is None
    low, high = interval([np.array([1e-9])] * 19 + [np.array([1.0])])
    assert low < 1e-9 and high > 100.0


@pytest.mark.parametrize("k", [0, 1, 2])
def test_fewer_than_three_clusters_have_no_interval_of_an_rms(k):
    assert metrics.rms_interval([np.array([1e-3]), np.array([0.04])][:k]) is None


def interval(clusters: list[np.ndarray]) -> tuple[float, float]:
    found = metrics.rms_interval(clusters)
    assert found is not None
    return found


def test_the_interval_of_an_rms_of_alike_clusters_covers_it_about_as_often_as_stated():
    drawn = np.random.default_rng(0).normal(size=(400, 12, 3))
    found = [interval(list(one)) for one in drawn]
    assert 0.92 < np.mean([low <= 1.0 <= high for low, high in found]) < 0.98
    # Three clusters, by hand: t of two degrees of freedom; logarithms of the mean squares without each.
    low, high = interval([np.array([1.0]), np.array([3.0]), np.array([1.0])])
    logs = np.log([5.0, 1.0, 5.0]) / 2
    reach = 4.30265 * np.sqrt(2 / 3 * ((logs - logs.mean()) ** 2).sum())
    assert np.log([low, high]) == pytest.approx(np.log(11 / 3) / 2 + np.array([-reach, reach]), rel=1e-4)


def test_the_expected_calibration_error_is_the_mean_gap_of_the_bins():
    probability = np.array([0.1] * 10 + [0.9] * 30)
    success = np.array([True] * 3 + [False] * 7 + [True] * 24 + [False] * 6)
    expected = (10 * 0.2 + 30 * 0.1) / 40
    assert metrics.expected_calibration_error(probability, success) == pytest.approx(expected)
    assert np.isnan(metrics.expected_calibration_error(np.zeros(0), np.zeros(0)))
