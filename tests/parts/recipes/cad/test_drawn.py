"""Drawn castings against formulas."""

import math

import pytest

from tests.parts.recipes.cad.made_parts import made, needs_cad


@needs_cad
def test_a_drawn_angle_has_its_fillet_and_bores(listed):
    solid = made(listed, "cast_angle_45x40")
    a, b, c, d, e, f = (listed["cast_angle_45x40"].dimensions[f"{key}_mm"] for key in "abcdef")
    legs = c * d * (a + b - d) + (1 - math.pi / 4) * e * e * c
    corners = 2 * (1 - math.pi / 4) * (c / 5) ** 2 * d
    expected = legs - corners - 2 * math.pi / 4 * f * f * d
    assert solid.mesh.volume == pytest.approx(expected, rel=0.01)
    assert solid.hulls == ()
