"""Noise of a depth image: its standard deviation, and the step in which the depth comes."""

from __future__ import annotations

import math

import numpy as np

QUIET = 0.0003
"""Deviation of the heights above which an image is noisy, metres; one stored in 0.1 mm has up to 0.03."""
COARSE, COARSEST = 0.0002, 0.005
"""Least and greatest step of depth that is coarse, metres: medians of noise of less than half a step are 0.
Cameras deliver whole millimetres, for example; an image stored in 0.1 mm is exact."""


def coarse_step(depth: np.ndarray, near: np.ndarray) -> float:
    """Find the step in which depth comes, metres; 0 if it is not coarse, or no noise moves pixels by a step.

    Args:
        depth: (h, w) metres, NaN where invalid.
        near: (h, w) bool, the valid pixels that count; most of them are on the table.
    """
    changes, both = _steps(depth[::4], near[::4])
    changed = changes[both & (changes > 0)]
    step = float(changed.min(initial=np.inf))
    if not COARSE < step < COARSEST:
        return 0.0
    n_steps = np.rint(changed / step)
    # In an exact image only edges differ by a whole number of steps, by chance.
    often = np.count_nonzero(n_steps == 1) > 0.02 * np.count_nonzero(both)
    return step if often and np.abs(changed / step - n_steps).max() < 0.1 else 0.0


def deviation_of_steps(offsets: np.ndarray, step: float) -> float:
    """Estimate the standard deviation of offsets that come in steps, metres, without those of edges.

    Args:
        offsets: (n,) metres.
        step: Step in which they come, metres.
    """
    sizes = np.abs(offsets)
    kept = sizes[sizes <= 4 * max(step, 1.4826 * float(np.median(sizes)))]
    return float(np.sqrt((kept**2).mean()))


def pixel_noise(heights: np.ndarray, near: np.ndarray, step: float) -> float:
    """Estimate the standard deviation of a pixel's noise, metres, from the steps between neighbours.

    0 if it is less than `QUIET`.

    Args:
        heights: (h, w) above the table, metres, NaN where invalid.
        near: (h, w) bool, the valid pixels that count; most of them are on the table.
        step: Step in which depth comes (`coarse_step`), metres; 0: it is not coarse.
    """
    # The median step is 0.6745 deviations of a step, which is sqrt(2) those of a pixel.
    deviations = 0.6745 * math.sqrt(2)
    few, fewer = _steps(heights[::4], near[::4])
    if not step and 4 * np.count_nonzero((few > QUIET * deviations) & fewer) < np.count_nonzero(fewer):
        return 0.0  # far from half of them: a quarter of the rows suffices
    steps, both = _steps(heights, near)
    if not both.any():
        return 0.0
    noise = float(np.median(steps[both])) / deviations
    if step:  # rounding alone deviates by step / sqrt(12)
        noise = max(deviation_of_steps(steps[both], step) / math.sqrt(2), step / math.sqrt(12))
    return noise if noise > QUIET else 0.0


def _steps(heights: np.ndarray, near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute the steps (h, w - 1) between neighbours of a row, and whether both are near."""
    return np.abs(np.diff(heights, axis=1)), near[:, 1:] & near[:, :-1]
