"""Central intervals of predictions: what they hold of errors that are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from mskgrasp.core.predicted_intervals import (
    LEVELS,
    calibration_error,
    coverage,
    half_width_of,
    measured_half_widths,
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
    table = measured_half_widths(np.zeros_like(std), variance, errors())
    other = errors()
    for level in (0.2, 0.5, 0.63, 0.8, 0.9, 0.95, 0.99):
        covered = coverage(
            np.zeros_like(std), variance, other, level, lambda level: half_width_of(table, level)
        )
        assert np.allclose(covered, level, atol=0.012)
        assert half_width_of(table, level)[2] == pytest.approx(norm.ppf((1 + level) / 2), rel=0.03)
    # A normal's width holds all of one half, and of the other what lies within a third of it.
    expected = 0.5 + 0.5 * (2 * norm.cdf(norm.ppf(0.75) / 3) - 1)
    assert coverage(np.zeros_like(std), variance, other, 0.5)[0] == pytest.approx(expected, abs=0.01)


def test_half_widths_beyond_the_table_grow_as_a_normals():
    table = np.array([[2 * normal_half_width(level)] for level in LEVELS])
    assert half_width_of(table, 0.999) == pytest.approx(2 * norm.ppf(0.9995))
    assert half_width_of(table, 0.01) == pytest.approx(2 * norm.ppf(0.505))


def test_calibration_error_is_none_of_honest_gaussians_and_large_of_boastful_ones():
    rng = np.random.default_rng(0)
    std = rng.uniform(0.001, 0.01, (20_000, 4))
    true = rng.normal(0, std)
    honest = calibration_error(np.zeros_like(std), std**2, true)
    boastful = calibration_error(np.zeros_like(std), (std / 3) ** 2, true)
    assert (honest < 0.01).all() and (boastful > 0.2).all()
