"""Planes through points that are known."""

from __future__ import annotations

import numpy as np
import pytest

from hal.touch.plane import NoPlane, fit_plane

REGION = (0.38, 0.62, -0.12, 0.12)
XY = np.array([[0.38, -0.12], [0.62, -0.12], [0.62, 0.12], [0.38, 0.12], [0.5, 0.0]])


def points(z: float = 0.0, slope: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    return np.column_stack([XY, z + (XY - [0.5, 0.0]) @ slope])


def test_height_and_slope_of_a_plane_are_found():
    plane = fit_plane(points(0.013, (0.007, -0.005)), REGION, 5e-4)
    assert plane.z == pytest.approx(0.013) and plane.slope == pytest.approx((0.007, -0.005))
    assert plane.residuals == pytest.approx(np.zeros(5), abs=1e-12)
    assert plane.tilt_rad == pytest.approx(np.arctan(np.hypot(0.007, 0.005)))
    assert plane.rise == pytest.approx(0.12 * 0.012) and not plane.level


def test_a_tilt_of_less_than_half_a_millimetre_does_not_matter():
    assert fit_plane(points(0.1, (0.002, 0.002)), REGION, 5e-4).level
    assert not fit_plane(points(0.1, (0.0025, 0.002)), REGION, 5e-4).level


@pytest.mark.parametrize("slope", [(0.055, 0.0), (0.0, -0.055)])
def test_a_table_steeper_than_a_cell_may_state_is_refused(slope: tuple[float, float]):
    assert fit_plane(points(0.0, (0.0499, -0.0499)), REGION, 5e-4).slope[0] == pytest.approx(0.0499)
    with pytest.raises(NoPlane, match="rises by .*55.* along y; at most 50 either way.* Level it"):
        fit_plane(points(0.0, slope), REGION, 5e-4)


@pytest.mark.parametrize("number", range(5))
def test_one_touch_of_something_2_mm_high_fits_no_plane(number: int):
    found = points(0.01, (0.007, 0.0))
    found[number, 2] += 0.002
    with pytest.raises(NoPlane, match="fit no plane") as caught:
        fit_plane(found, REGION, 5e-4)
    assert "\n" not in str(caught.value)


def test_touches_that_scatter_by_a_tenth_of_a_millimetre_are_accepted():
    found = points(0.01) + np.random.default_rng(0).normal(0, 1e-4, (5, 3)) * [0, 0, 1]
    assert fit_plane(found, REGION, 5e-4).z == pytest.approx(0.01, abs=1e-4)
