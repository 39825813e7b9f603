"""Shares of trials, with intervals that know about parts."""

import numpy as np
import pytest

from mskgrasp.core.metrics import wilson_interval
from mskgrasp.core.share import Share


def test_trials_of_one_part_have_wilsons_interval():
    found = Share.count([True, True, False, True], ["nut"] * 4)
    assert (found.n, found.of, found.value) == (3, 4, 0.75)
    assert found.interval == pytest.approx(wilson_interval(3, 4))


def test_the_interval_of_a_share_is_wide_where_parts_differ():
    hits = np.repeat([True, False] * 5, 20)
    low, high = Share.count(hits, np.repeat([f"part {n}" for n in range(10)], 20)).interval
    alike = Share.count(hits, ["part"] * 200).interval
    assert low < 0.3 < alike[0] < 0.5 < alike[1] < 0.7 < high
    assert Share.count(np.zeros(0, bool), []).interval == (0.0, 1.0)
    assert Share.count(np.ones(100, bool), ["a", "b"] * 50).interval[0] < 0.97  # nothing is certain


def test_nothing_is_known_of_no_trial():
    assert Share.count([], []) == Share(n=0, of=0, value=0.0, interval=(0.0, 1.0))


def test_a_stored_share_is_the_same():
    found = Share.count([True, False, True], ["nut", "nut", "bolt"])
    assert Share.from_json(found.to_json()) == found
