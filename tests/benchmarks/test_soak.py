"""The slope of the memory of a long run, and what is measured."""

from __future__ import annotations

import gc
import mmap

import numpy as np
import pytest

from tests.benchmarks.soak import MEGABYTE, growth, own_memory, soak


@pytest.mark.parametrize(
    ("slope", "verdict"),
    [(0.0, "flat"), (10.0, "flat"), (60.0, "grows"), (-30.0, "flat"), (20.0, "undecided")],
)
def test_the_slope_is_found_in_noise_and_the_warm_up_is_left_out(slope: float, verdict: str):
    hours = np.linspace(0.01, 2, 900)
    noise = np.random.default_rng(0).normal(scale=5.0, size=len(hours))
    filling = np.where(hours < 0.4, -300.0 * (0.4 - hours), 0.0)
    found = growth(hours.tolist(), (1500 + slope * hours + filling + noise).tolist())
    assert found.low <= slope <= found.high and found.high - found.low < 8
    assert found.verdict == verdict


def test_a_short_run_is_no_verdict():
    with pytest.raises(ValueError, match="run longer"):
        growth([0.1, 0.2, 0.3], [1.0, 1.0, 1.0])


def test_memory_that_is_held_is_seen():
    gc.collect()  # what earlier tests left would be freed in between
    before = own_memory()
    # Mapped by the system itself: an array may lie in memory that was freed, and is kept when it is freed.
    with mmap.mmap(-1, 64 * MEGABYTE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS) as held:
        for _ in range(64):
            held.write(b"1" * MEGABYTE)
        assert 60 * MEGABYTE < own_memory() - before < 80 * MEGABYTE
    assert own_memory() - before < 10 * MEGABYTE


def test_trials_run_until_the_time_is_over():
    hours, memory, lifted = soak(["hex_nut_m30"], 1.0, n_candidates=60, seed=0)
    assert 3600 * hours[-1] >= 1.0 and all(one < two for one, two in zip(hours, hours[1:], strict=False))
    assert len(memory) == len(hours) and 0 <= lifted <= len(hours) and min(memory) > 100
