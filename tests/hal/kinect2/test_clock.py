from __future__ import annotations

import pytest

from hal.kinect2.clock import TICK_S, ExposureClock


def test_frames_are_dated_by_the_quickest_and_never_too_late():
    clock = ExposureClock(0.1)
    travelled = [0.09, 0.05, 0.08, 0.05, 0.07]
    for k, travel_s in enumerate(travelled):
        exposed_s = 100 + k / 30
        dated_s, _ = clock.date(round(k / 30 / TICK_S), exposed_s + travel_s)
        # Between the exposure and 0.1 s before it, because the quickest of all frames needs something, too.
        assert exposed_s - 0.1 - 1e-3 <= dated_s <= exposed_s + 1e-3


def test_a_frame_held_up_on_its_way_is_late():
    clock = ExposureClock(0.1)
    clock.date(0, 100.0)
    assert clock.date(8000, 101.5)[1] == pytest.approx(0.5, abs=1e-3)


def test_the_counter_wraps_round():
    clock = ExposureClock(0.1)
    clock.date(2**32 - 100, 100.0)
    assert clock.advance_s(166, 100.0 + 266 * TICK_S) == pytest.approx(266 * TICK_S)
    assert clock.date(166, 100.0 + 266 * TICK_S)[1] == pytest.approx(0, abs=1e-4)
    now_s = 100.0 + 266 * TICK_S
    assert clock.advance_s(166, now_s) == 0 and clock.advance_s(165, now_s) < 0


@pytest.mark.parametrize("days", [1.0, 3.2, 6.5, 40.0])
def test_a_camera_that_was_open_and_idle_for_days_goes_on(days):
    clock = ExposureClock(0.1)
    clock.date(123, 100.0)
    idle_s = 86400 * days
    ticks = (123 + round(idle_s / TICK_S)) % 2**32
    assert clock.advance_s(ticks, 100.0 + idle_s) == pytest.approx(idle_s)
    assert clock.date(ticks, 100.0 + idle_s)[1] == pytest.approx(0, abs=1e-3)


def test_a_clock_that_runs_slow_does_not_make_frames_late():
    """50 parts in a million are 0.18 s an hour."""
    clock = ExposureClock(0.1)
    late = [clock.date(round(t * (1 - 50e-6) / TICK_S), 1000.0 + t)[1] for t in range(0, 7200, 60)]
    assert max(late) < 0.02
