"""The simulation of coverage: its methods agree where they must, and its truth is the truth."""

from __future__ import annotations

import numpy as np
import pytest

from tests.benchmarks.interval_coverage import RMS_METHODS, rms_rows, share_rows


def test_intervals_of_many_parts_that_are_alike_agree_and_hold_the_rms():
    rng = np.random.default_rng(0)
    squares = rng.uniform(0.9, 1.1, 100)
    found = np.array([method(squares, rng) for method in RMS_METHODS.values()])
    assert (found[:, 0] < 1.0).all() and (found[:, 1] > 0.99).all()
    assert found[:, 0] == pytest.approx(found[0, 0], abs=2e-3)
    assert found[:, 1] == pytest.approx(found[0, 1], abs=2e-3)


def test_every_row_has_the_coverage_of_every_method():
    rng = np.random.default_rng(0)
    for first, rows in ((2, rms_rows(3, rng)), (4, share_rows(3, rng))):
        for row in rows:
            assert all("%, width " in str(cell) for cell in row[first:])
