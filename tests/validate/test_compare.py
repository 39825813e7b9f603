"""Differences between outcomes are those that were put in."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from mskgrasp.validate.compare import Comparison, compare_outcomes
from tests.validate.made_up import moved, outcomes


def test_differences_are_those_that_were_put_in():
    before = outcomes()
    one = before.success.copy()
    one[:10] = ~one[:10]
    after = moved(before, np.array([0.003, 0.0, 0.004, 0.02]))
    result = compare_outcomes(
        dataclasses.replace(
            after, displacement=np.where(one[:, None], after.displacement, np.nan), success=one
        ),
        before,
    )
    assert result.agreement == pytest.approx(0.95)
    assert result.n_both == 95
    assert result.shift_median == pytest.approx(0.005) and result.shift_p90 == pytest.approx(0.005)
    assert result.turn_median == pytest.approx(0.02) and result.bias == pytest.approx(0.004)


def test_a_turn_over_half_a_circle_is_measured_the_short_way():
    before, after = outcomes(), outcomes()
    before.displacement[:, 3], after.displacement[:, 3] = np.pi - 0.01, -np.pi + 0.01
    assert compare_outcomes(after, before).turn_median == pytest.approx(0.02)


def test_grasps_whose_part_was_not_at_rest_are_left_out():
    before = outcomes()
    unsettled = np.arange(len(before.success)) < 50
    after = moved(before, np.where(unsettled[:, None], 0.1, 0.0))
    result = compare_outcomes(dataclasses.replace(after, settled=~unsettled), before)
    assert result.n == len(before.success) - 50 and result.shift_p90 == pytest.approx(0, abs=1e-12)


def test_a_comparison_is_read_back_from_what_a_report_stores():
    before = outcomes()
    nothing = compare_outcomes(
        dataclasses.replace(before, success=np.zeros(len(before.success), bool)), before
    )
    stored = json.loads(json.dumps(nothing.to_json()))
    assert stored["shift_median"] is None
    assert repr(Comparison.from_json(stored)) == repr(nothing)
