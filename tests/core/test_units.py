"""Units of length in CAD files."""

from __future__ import annotations

from typing import get_args

import pytest

from mskgrasp.core.units import MILLIMETRES, Unit


def test_every_unit_has_a_length_and_an_inch_is_254_tenths_of_a_millimetre():
    assert set(MILLIMETRES) == set(get_args(Unit))
    assert MILLIMETRES["in"] == 25.4 and MILLIMETRES["m"] == pytest.approx(1e3 * MILLIMETRES["mm"])
