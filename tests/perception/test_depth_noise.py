import math

import numpy as np
import pytest

from mskgrasp.perception.depth_noise import QUIET, coarse_step, deviation_of_steps, pixel_noise
from tests.synthetic import OVERHEAD, Box, render

DEPTH = render([Box(x=0.455, y=0.0, yaw=0.4, size=(0.06, 0.04, 0.03))])
EVERYWHERE = np.ones(DEPTH.shape, bool)


def noisy(deviation, seed=0):
    return DEPTH + np.random.default_rng(seed).normal(0.0, deviation, DEPTH.shape)


def in_steps(depth, step):
    return np.round(depth / step) * step


def noise_of(depth, step=0.0, near=EVERYWHERE):
    return pixel_noise(OVERHEAD.position[2] - depth, near, step)


@pytest.mark.parametrize("deviation", [0.0005, 0.001, 0.003])
@pytest.mark.parametrize("degrees", [0.0, 2.0])
def test_noise_is_measured_beside_a_part_and_on_a_tilted_table(deviation, degrees):
    slope = math.tan(math.radians(degrees)) * 0.8 / 365.5  # metres a pixel
    depth = noisy(deviation) + slope * np.arange(DEPTH.shape[1])
    assert noise_of(depth) == pytest.approx(deviation, rel=0.05)


@pytest.mark.parametrize("deviation", [0.0, 0.00003, 0.8 * QUIET])
def test_a_quiet_image_has_no_noise(deviation):
    assert noise_of(noisy(deviation)) == 0.0


def test_only_pixels_that_are_near_count():
    depth = noisy(0.001)
    depth[:, 80:] = noisy(0.01)[:, 80:]
    depth[100:] = np.nan
    left = EVERYWHERE.copy()
    left[:, 80:] = left[100:] = False
    assert noise_of(depth, near=left) == pytest.approx(0.001, rel=0.05)
    assert noise_of(depth, near=~EVERYWHERE) == 0.0


@pytest.mark.parametrize("step", [0.0005, 0.001, 0.004])
def test_the_step_of_coarse_depth_is_found_where_noise_moves_pixels_by_it(step):
    assert coarse_step(in_steps(noisy(0.4 * step), step), EVERYWHERE) == pytest.approx(step, rel=1e-6)
    assert coarse_step(in_steps(DEPTH, step), EVERYWHERE) == 0.0


def test_depth_in_steps_of_a_tenth_of_a_millimetre_and_depth_in_none_are_not_coarse():
    assert coarse_step(in_steps(noisy(0.001), 0.0001), EVERYWHERE) == 0.0
    assert coarse_step(noisy(0.001), EVERYWHERE) == 0.0


@pytest.mark.parametrize("deviation", [0.0003, 0.0005, 0.001])
def test_noise_of_less_than_a_step_is_measured_with_that_of_rounding(deviation):
    """A median of the steps between neighbours would be 0, or a whole step."""
    rounded = math.hypot(deviation, 0.001 / math.sqrt(12))
    depth = in_steps(noisy(deviation) + 0.0005 * np.linspace(-1, 1, DEPTH.shape[1]), 0.001)
    assert noise_of(depth, step=0.001) == pytest.approx(rounded, rel=0.1)


def test_edges_do_not_count_among_offsets_in_steps():
    offsets = np.array([-0.001, 0.001] * 50)
    edges = np.array([0.03, -0.05, 0.02])
    assert deviation_of_steps(np.concatenate([offsets, edges]), 0.001) == pytest.approx(0.001)
