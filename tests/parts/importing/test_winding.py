"""Winding numbers and miscounted volume against formulas."""

import numpy as np
import pytest

from mskgrasp.parts.importing.winding import miscounted_fraction, winding_number
from mskgrasp.parts.solids.surface import Surface
from tests.parts.importing.surfaces import box, extruded, refusal, torus


def pentagram() -> Surface:
    """A star drawn in one stroke: its middle lies inside twice."""
    angle = np.pi / 2 + 4 * np.pi / 5 * np.arange(5)
    return extruded(30 * np.stack([np.cos(angle), np.sin(angle)], axis=1), 10.0)


def test_volume_counted_twice_is_measured_as_the_formula_says_and_refused():
    star = pentagram()
    stroke = 5 / 2 * 30**2 * np.sin(4 * np.pi / 5)
    middle = 5 / 2 * (30 * (3 - np.sqrt(5)) / 2) ** 2 * np.sin(2 * np.pi / 5)
    assert star.volume == pytest.approx(10 * stroke)
    assert miscounted_fraction(star.triangles) == pytest.approx(middle / (stroke - middle), rel=0.02)
    assert refusal(star).startswith("crosses itself: ")
    assert winding_number(star.triangles, np.array([0.1, 0.2, 5.0])) == pytest.approx(2)


@pytest.mark.parametrize("surface", [box(40, 30, 20), torus(), box(100, 60, 1)])
def test_a_surface_that_does_not_cross_itself_has_nothing_counted_twice(surface):
    assert miscounted_fraction(surface.triangles) == 0
    assert winding_number(surface.triangles, surface.vertices.max(axis=0) + 1) == pytest.approx(0, abs=1e-9)
