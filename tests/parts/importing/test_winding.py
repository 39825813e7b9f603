"""Winding numbers and miscounted volume against formulas."""

import numpy as np
import pytest
from manifold3d import CrossSection, Manifold, OpType

from mskgrasp.parts.importing.winding import _crossings, miscounted_fraction, winding_number
from mskgrasp.parts.solids.surface import Surface, manifold_of, surface_of
from tests.parts.importing.surfaces import box, extruded, one, refusal, torus


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


def angle(thickness: float) -> Surface:
    """An angle of 150 x 150 x 20 mm."""
    a, t = 150.0, thickness
    outline = np.array([(0, 0), (a, 0), (a, t), (t, t), (t, a), (0, a)])
    body = Manifold.extrude(CrossSection([outline]), 20.0)
    return surface_of(body)


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("thickness", [0.3, 0.7])
def test_a_sound_wall_between_all_lines_of_an_axis_has_nothing_counted_twice(turns, thickness):
    surface = surface_of(manifold_of(angle(thickness)).rotate((0, 0, 90 * turns)))
    assert miscounted_fraction(surface.triangles) == 0
    assert one(surface).notes == ()


def test_a_thin_frame_between_all_lines_of_all_axes_cannot_be_looked_at_and_is_refused():
    rods = [Manifold.cube((150, 0.2, 0.2)), Manifold.cube((0.2, 150, 0.2)), Manifold.cube((0.2, 0.2, 150))]
    frame = Manifold.batch_boolean(rods, OpType.Add)
    surface = surface_of(frame)
    assert all(not len(_crossings(surface.triangles, axis)[0]) for axis in range(3))
    assert np.isnan(miscounted_fraction(surface.triangles))
    assert refusal(surface) == "is thinner than 1/128 of its size everywhere: make it thicker"
