"""The minimum-jerk profile of a motion (Flash and Hogan 1985, equation 5).

It starts and ends without speed and acceleration: with an acceleration at the end an arm would overshoot by
its inertia over its stiffness, more than the clearance between pads and table.
"""

from __future__ import annotations

import math

import numpy as np


def minimum_jerk(t: np.ndarray) -> np.ndarray:
    """Fractions of a path, from 0 to 1, at fractions ``t`` of its duration."""
    return t**3 * (10 - 15 * t + 6 * t**2)


def minimum_jerk_steps(n_steps: int) -> np.ndarray:
    """(n_steps,) fractions of a path at the ends of equal time steps, from just above 0 to 1."""
    return minimum_jerk(np.arange(1, n_steps + 1) / n_steps)


def minimum_jerk_duration(
    distance: float, peak_speed: float, peak_acceleration: float, *, shortest_s: float = 0.02
) -> float:
    """Seconds over a distance that exceed neither a peak speed nor a peak acceleration.

    The profile's peaks are 15/8 of the mean speed and 10/sqrt(3) distance / time^2. A short distance needs
    the second bound: at full speed its acceleration would make the arm overshoot.
    """
    return max(
        15 / 8 * distance / peak_speed,
        math.sqrt(10 / math.sqrt(3) * distance / peak_acceleration),
        shortest_s,
    )
