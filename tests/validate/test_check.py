"""A number passes inside its tolerance, bounds included, and an unknown one does not."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mskgrasp.validate.check import Check, near, within


def check(measured: float) -> Check:
    return Check(name="x", formula="y", unit="m", expected=1.0, measured=measured, low=0.9, high=1.2)


@pytest.mark.parametrize(
    ("measured", "passed"),
    [
        (0.9, True), (1.2, True), (1.0, True), (math.nextafter(0.9, 0), False),
        (math.nextafter(1.2, 2), False), (math.nan, False), (math.inf, False), (-math.inf, False),
    ],
)  # fmt: skip
def test_bounds_pass_and_what_is_unknown_does_not(measured: float, passed: bool):
    assert check(measured).passed is passed


@given(st.floats(-100, 100).filter(lambda x: abs(x) > 1e-6), st.floats(0.001, 0.5))
def test_a_share_of_the_expected_value_is_a_tolerance_of_either_sign(expected: float, share: float):
    for factor, passed in ((1 + 0.99 * share, True), (1 - 0.99 * share, True), (1 + 1.01 * share, False)):
        one = near("x", "y", "m", expected, factor * expected, share)
        assert one.passed is passed and one.low < one.high


def test_a_margin_lies_to_either_side():
    one = within("x", "y", "mm", -12.0, -11.9, 0.15)
    assert (one.low, one.high) == (-12.15, -11.85) and one.passed
    assert not within("x", "y", "mm", -12.0, 12.0, 0.15).passed


def test_a_check_is_stored_with_its_verdict():
    stored = json.loads(json.dumps(check(1.3).to_json()))
    assert stored == dict(
        name="x", formula="y", unit="m", expected=1.0, measured=1.3, low=0.9, high=1.2, passed=False
    )
