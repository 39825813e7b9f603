"""Two one-sided tests: what is inside the margin passes, what is not does not, at the level they promise."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mskgrasp.validate.equivalence import ALPHA, LEAST_PARTS, Equivalence, mean_difference, median_excess

MARGIN = 2.5e-4
PARTS, GRASPS = 31, 20
PART = np.repeat(np.arange(PARTS), GRASPS)


def distances(rng: np.random.Generator) -> np.ndarray:
    """As a floor has them: tens of micrometres, millimetres in the tail, alike within a part."""
    return 8e-5 * np.exp(0.6 * rng.normal(size=PARTS)[PART] + 1.2 * rng.normal(size=len(PART)))


def gained(rng: np.random.Generator, rate: float, spread: float) -> np.ndarray:
    """Differences of success of mean ``rate``; 4 % of the grasps differ, more in some parts than others."""
    up = np.clip((0.04 + rate) / 2 + spread * rng.uniform(-1, 1, PARTS)[PART], 0, 1)
    down = np.clip((0.04 - rate) / 2 + spread * rng.uniform(-1, 1, PARTS)[PART], 0, 1)
    drawn = rng.uniform(size=len(PART))
    return np.where(drawn < up, 1.0, np.where(drawn > 1 - down, -1.0, 0.0))


def share_passed(runs: int, test) -> float:
    return float(np.mean([test(np.random.default_rng([7, k])).passed for k in range(runs)]))


@given(st.floats(0, 2 * MARGIN))
def test_a_shift_of_all_distances_is_estimated_exactly(shift: float):
    floor = distances(np.random.default_rng(0))
    found = median_excess(floor + shift, floor, PART, MARGIN, replicates=50)
    assert found.estimate == pytest.approx(shift, abs=1e-12)
    assert found.low == pytest.approx(shift, abs=1e-12) and found.high == pytest.approx(shift, abs=1e-12)
    if abs(shift - MARGIN) > 1e-9:
        assert found.passed == (shift < MARGIN)


@pytest.mark.parametrize(("shift", "passed"), [(0.0, True), (0.6 * MARGIN, True), (1.4 * MARGIN, False)])
def test_independent_distances_inside_the_margin_pass_and_others_do_not(shift: float, passed: bool):
    def test(rng: np.random.Generator) -> Equivalence:
        return median_excess(distances(rng) + shift, distances(rng), PART, MARGIN, replicates=200)

    share = share_passed(40, test)
    assert share > 0.8 if passed else share <= ALPHA


@pytest.mark.slow
def test_a_median_at_the_margin_passes_no_more_often_than_the_level():
    def test(rng: np.random.Generator) -> Equivalence:
        return median_excess(distances(rng) + MARGIN, distances(rng), PART, MARGIN, replicates=200)

    # 300 runs at the level: the standard error is 1.3 points.
    assert share_passed(300, test) < ALPHA + 0.03


def test_a_success_rate_at_the_margin_passes_no_more_often_than_the_level():
    for rate in (0.02, -0.02):
        share = share_passed(
            1000, lambda rng, rate=rate: mean_difference(gained(rng, rate, 0.01), PART, 0.02)
        )
        assert share < ALPHA + 0.02  # three standard errors


def test_success_rates_that_are_equal_pass_mostly():
    assert share_passed(200, lambda rng: mean_difference(gained(rng, 0.0, 0.0), PART, 0.02)) > 0.4
    assert share_passed(200, lambda rng: mean_difference(gained(rng, 0.04, 0.0), PART, 0.02)) < 0.01


def test_grasps_that_differ_together_within_parts_widen_the_interval():
    rng = np.random.default_rng(0)
    alone = rng.permutation(np.repeat([1.0, -1.0, 0.0], [40, 40, len(PART) - 80]))
    together = np.zeros(len(PART))
    together[:40], together[-40:] = 1, -1
    apart, joint = (mean_difference(one, PART, 0.02) for one in (alone, together))
    assert apart.estimate == joint.estimate == pytest.approx(0, abs=1e-12)
    assert joint.high > 2 * apart.high


def test_few_grasps_without_a_difference_prove_nothing():
    found = mean_difference(np.zeros(24), np.repeat(np.arange(12), 2), 0.02)
    # At a rate of 11.7 % none of 24 differs in 5 % of the cases.
    assert found.high == pytest.approx(0.117, abs=1e-3) and not found.passed


def test_few_parts_prove_nothing():
    few = np.repeat(np.arange(LEAST_PARTS - 1), 200)
    assert not mean_difference(np.zeros(len(few)), few, 0.02).passed
    assert not median_excess(np.zeros(len(few)), np.zeros(len(few)), few, MARGIN, replicates=10).passed


def test_what_is_unknown_is_null_in_json_and_does_not_pass():
    nothing = median_excess(np.zeros(0), np.zeros(0), np.zeros(0), MARGIN)
    assert not nothing.passed and math.isinf(nothing.excess)
    assert nothing.to_json()["estimate"] is None and nothing.to_json()["excess"] is None
