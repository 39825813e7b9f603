"""The minimum-jerk profile: its bounds, its ends, and its rate."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mskgrasp.core.minimum_jerk import (
    minimum_jerk,
    minimum_jerk_duration,
    minimum_jerk_steps,
)
from tasks.robot.motion import PEAK_ACCELERATION


@pytest.mark.parametrize(("distance", "speed"), [(0.01, 0.25), (0.06, 0.25), (0.3, 0.25), (0.02, 1.0)])
def test_a_path_passes_neither_its_speed_nor_its_acceleration(distance, speed):
    seconds = minimum_jerk_duration(distance, speed, PEAK_ACCELERATION)
    n = 2000
    way = distance * np.concatenate([[0.0], minimum_jerk_steps(n)])
    velocity = np.diff(way) * n / seconds
    acceleration = np.diff(velocity) * n / seconds
    assert way[-1] == pytest.approx(distance)
    assert velocity.max() <= speed * 1.001
    assert np.abs(acceleration).max() <= PEAK_ACCELERATION * 1.01
    # One of the bounds is reached: the path is not slower than it must be.
    assert velocity.max() > speed * 0.99 or np.abs(acceleration).max() > PEAK_ACCELERATION * 0.99


def test_a_motion_starts_and_ends_at_rest_without_acceleration():
    """Finite differences at both ends and in the middle; by symmetry half of the way is covered by then."""
    h = 1e-4
    for end in (0.0, 1.0):
        near = minimum_jerk(end + np.array([-h, 0.0, h]))
        assert near[1] == end
        assert (near[2] - near[0]) / (2 * h) == pytest.approx(0, abs=1e-6)
        assert (near[2] - 2 * near[1] + near[0]) / h**2 == pytest.approx(0, abs=0.01)
    assert minimum_jerk(np.array(0.5)) == 0.5


@given(st.floats(0, 1))
def test_the_second_half_mirrors_the_first(t: float):
    assert minimum_jerk(np.array(t)) + minimum_jerk(np.array(1 - t)) == pytest.approx(1)


def test_steps_end_at_the_goal_and_none_is_the_start():
    steps = minimum_jerk_steps(10)
    assert len(steps) == 10 and steps[0] > 0 and steps[-1] == 1 and (np.diff(steps) > 0).all()
    assert minimum_jerk_steps(1).tolist() == [1.0]


def test_no_motion_is_shorter_than_the_shortest():
    assert minimum_jerk_duration(0.0, 0.25, 1.5) == 0.02
    assert minimum_jerk_duration(1e-6, 0.25, 1.5, shortest_s=0.5) == 0.5
    assert minimum_jerk_duration(1.0, 0.25, 1.5) == pytest.approx(15 / 8 / 0.25)
