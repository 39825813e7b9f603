"""Sizes of both squares of tape."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from mskgrasp.core.settings import Tape


@given(st.floats(0.006, 0.04), st.floats(0.004, 0.03))
def test_squares_are_accepted_where_the_larger_is_larger_by_a_quarter_at_least(large: float, small: float):
    if large / small > 1.25001:
        assert Tape(large=large, small=small).sides == (large, small)
    elif large / small < 1.24999:
        with pytest.raises(ValidationError, match=r"at least 1.25 times small .* taken for each other"):
            Tape(large=large, small=small)


def test_the_usual_squares_are_of_12_and_8_mm():
    assert Tape().sides == (0.012, 0.008)


@pytest.mark.parametrize("values", [dict(large=12), dict(large=0.05), dict(small=0.003), dict(middle=0.01)])
def test_squares_in_millimetres_or_of_unusable_size_are_refused(values: dict[str, float]):
    with pytest.raises(ValidationError):
        Tape.model_validate(values)
