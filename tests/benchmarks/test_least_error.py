"""The benchmark that tells how well any predictor can do says so of spreads that are known."""

from __future__ import annotations

import numpy as np
import pytest

from tests.benchmarks.least_error import least_errors


def test_the_least_error_is_the_spread_within_a_grasp():
    rng = np.random.default_rng(0)
    # Where a grasp ends on the whole is no error, and neither is a turn by a whole circle.
    means = rng.normal(0, [0.02, 0.02, 0.02, 1.0], (4000, 1, 4))
    rows = means + rng.normal(0, [0.001, 0.002, 0.002, 0.05], (4000, 3, 4))
    rows[::2, 0, 3] += 2 * np.pi
    n, torn, millimetres, degrees = least_errors(rows)
    assert (n, torn) == ("4000", "0.0%")
    assert float(millimetres) == pytest.approx(3.0, abs=0.05)
    assert float(degrees) == pytest.approx(np.degrees(0.05), abs=0.05)


def test_grasps_that_failed_say_nothing_of_the_displacement():
    rows = np.zeros((4, 2, 4))
    rows[:, 1, 0] = 0.002
    rows[1, 0], rows[2] = np.nan, np.nan
    n, torn, millimetres, _ = least_errors(rows)
    assert (n, torn) == ("4", "25.0%")
    # Two of 2 mm apart: 1.41 mm of deviation.
    assert float(millimetres) == pytest.approx(1.41)
