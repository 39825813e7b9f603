"""The minimum-jerk profile: its bounds, its ends, and its rate."""

from __future__ import annotations

import numpy as np
import pytest

from mskgrasp.core.minimum_jerk import minimum_jerk_duration, minimum_jerk_steps
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
