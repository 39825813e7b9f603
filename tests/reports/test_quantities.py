"""Quantities as text."""

from __future__ import annotations

import numpy as np
import pytest

from mskgrasp.reports.quantities import counted, degrees, millimetres


@pytest.mark.parametrize(
    ("value", "interval", "text"),
    [
        (0.00123, None, "1.2 mm"),
        (0.0, None, "0.0 mm"),  # a measured zero is no missing value
        (-0.0047, (-0.01, 0.00004), "-4.7 mm [-10.0, 0.0]"),
        (0.0023, (0.0, 277.0), "2.3 mm [0.0, inf]"),  # of two parts
        (None, None, "-"),
        (None, (0.1, 0.2), "-"),
    ],
)
def test_lengths_are_given_in_millimetres(value, interval, text):
    assert millimetres(value, interval) == text


def test_angles_are_given_in_degrees():
    assert degrees(np.pi / 8) == "22.5 deg"
    assert degrees(-np.pi, (-np.pi, np.pi / 2)) == "-180.0 deg [-180.0, 90.0]"
    assert degrees(None) == "-"


def test_counts_keep_their_order():
    assert counted({"slipped": 1, "missed": 20}) == "slipped 1, missed 20"
    assert counted({}) == ""
