"""Central intervals of predictions: what they hold of errors that are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from mskgrasp.core.predicted_intervals import (
    LEVELS,
    IntervalTable,
    calibration_error,
    coverage,
    measured_intervals,
    normal_half_width,
)


def test_true_gaussians_are_covered_as_often_as_they_should():
    rng = np.random.default_rng(0)
    std = np.array([0.001, 0.01, 0.1, 0.2])
    true = rng.normal(size=(20000, 4)) * std
    covered = coverage(np.zeros((20000, 4)), np.tile(std**2, (20000, 1)), true)
    assert np.allclose(covered, 0.9, atol=0.01)


def test_measured_half_widths_hold_as_much_of_other_errors_with_heavy_tails():
    rng = np.random.default_rng(0)
    std = rng.uniform(0.5, 2.0, (40000, 4))

    def errors() -> np.ndarray:
        # Half of one axis hardly err, the other axes are a normal's and a Student's.
        found = rng.normal(size=std.shape) * std
        found[:, 0] *= np.where(rng.random(len(std)) < 0.5, 0.01, 3.0)
        found[:, 1] = rng.standard_t(3, len(std)) * std[:, 1]
        return found * [1, 1, 1, 0.1]

    variance = (std * [1, 1, 1, 0.1]) ** 2
    half_width = measured_intervals(np.zeros_like(std), variance, errors()).half_width
    other = errors()
    for level in (0.2, 0.5, 0.63, 0.8, 0.9, 0.95, 0.99):
        assert np.allclose(
            coverage(np.zeros_like(std), variance, other, level, half_width), level, atol=0.012
        )
        widths = half_width(level, variance)[:, 2]
        assert np.median(widths) == pytest.approx(norm.ppf((1 + level) / 2), rel=0.03)
    # A normal's width holds all of one half, and of the other what lies within a third of it.
    expected = 0.5 + 0.5 * (2 * norm.cdf(norm.ppf(0.75) / 3) - 1)
    assert coverage(np.zeros_like(std), variance, other, 0.5)[0] == pytest.approx(expected, abs=0.01)


def test_intervals_hold_their_share_of_sure_and_of_unsure_predictions():
    """Small deviations are too large, as where a planner chose the grasp."""
    rng = np.random.default_rng(0)
    std = np.exp(rng.normal(size=(40_000, 4)))
    errors = rng.normal(size=std.shape) * std * np.where(std < 1, std, 1)
    fitted, other = slice(0, 20_000), slice(20_000, None)
    zero, variance = np.zeros_like(std), std**2
    table = measured_intervals(zero[fitted], variance[fitted], errors[fitted])
    for sure in (std[other, 0] < 0.5, std[other, 0] > 1.5):
        for level in (0.5, 0.9, 0.95):
            some = [values[other][sure] for values in (zero, variance, errors)]
            assert coverage(*some, level, table.half_width)[0] == pytest.approx(level, abs=0.03)
    assert coverage(*(values[other][std[other, 0] < 0.5] for values in (zero, variance, errors)))[0] > 0.99


def test_half_widths_beyond_the_table_grow_as_a_normals_and_those_of_its_ends_are_kept():
    column = [(2 * normal_half_width(level),) for level in LEVELS]
    wide = [(2 * row[0],) for row in column]
    table = IntervalTable(deviations=((0.1,), (10.0,)), half_widths=(tuple(column), tuple(wide)))

    def width(level: float, deviation: float) -> float:
        return float(table.half_width(level, np.array([[deviation**2]]))[0, 0])

    assert width(0.999, 0.1) == width(0.999, 0.01) == pytest.approx(2 * norm.ppf(0.9995))
    assert width(0.01, 10.0) == width(0.01, 99.0) == pytest.approx(4 * norm.ppf(0.505))
    assert width(0.9, 1.0) == pytest.approx(2 * np.sqrt(2) * norm.ppf(0.95))  # half way by the logarithm


def test_rows_of_equal_deviation_have_one_interval():
    """Some parts are better than others, and no deviation tells which."""
    rng = np.random.default_rng(0)
    errors = rng.normal(size=(2400, 4)) * np.where(np.arange(2400) < 2200, 1.0, 0.1)[:, None]
    half = np.where(np.arange(2400) % 2, 1.0, np.exp(rng.normal(size=2400)))
    for std in (np.ones(2400), half):
        table = measured_intervals(np.zeros_like(errors), np.tile(std[:, None] ** 2, 4), errors)
        for level in (0.5, 0.9):
            some = [v[std == 1.0] for v in (np.zeros_like(errors), np.tile(std[:, None] ** 2, 4), errors)]
            assert coverage(*some, level, table.half_width)[0] == pytest.approx(level, abs=0.04)


def test_a_wider_interval_is_never_of_less_probability():
    flat = [(min(2.0, 1.1 * normal_half_width(level)),) for level in LEVELS]
    table = IntervalTable(deviations=((1.0,),), half_widths=(tuple(flat),))
    levels, one = np.linspace(0.01, 0.999, 200), np.ones((1, 1))
    widths = [float(table.half_width(level, one)[0, 0]) for level in levels]
    assert (np.diff(widths) >= 0).all() and max(widths) > 2.0


def test_calibration_error_is_none_of_honest_gaussians_and_large_of_boastful_ones():
    rng = np.random.default_rng(0)
    std = rng.uniform(0.001, 0.01, (20_000, 4))
    true = rng.normal(0, std)
    honest = calibration_error(np.zeros_like(std), std**2, true)
    boastful = calibration_error(np.zeros_like(std), (std / 3) ** 2, true)
    assert (honest < 0.01).all() and (boastful > 0.2).all()
