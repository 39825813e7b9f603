"""Hinges: leaves at their angle, weights by hand."""

import math

import pytest

from tests.parts.recipes.families.made_shapes import cylinder, extents, is_inside, made


def test_the_leaves_of_a_hinge_open_by_their_angle():
    assert extents(made("butt_hinge_75x40_0")) == pytest.approx([40 + 5, 75, 10], abs=0.02)
    assert extents(made("butt_hinge_60x30_180")) == pytest.approx([60, 60, 10], abs=0.02)
    assert extents(made("butt_hinge_70x35_90")) == pytest.approx([40, 70, 40], abs=0.02)


def test_the_leaves_of_a_half_open_hinge_lie_at_45_degrees():
    solid = made("butt_hinge_132x45_45")
    x = 30 * math.cos(math.radians(45))
    assert is_inside(solid, x - 1, 0, x + 1) and not is_inside(solid, x + 2, 0, x - 2)
    assert is_inside(solid, 30, 0, -2) and not is_inside(solid, 30, 0, 1)


def test_a_block_hinge_weighs_like_its_leaves_and_the_crest_of_its_knuckle():
    crest = 36 * math.acos(1 / 6) - math.sqrt(35)
    expected = 64 * 50 * 7 + crest * 50 - 4 * cylinder(5.3, 7)
    assert made("block_hinge_50x32").mesh.volume == pytest.approx(expected, rel=0.003)


def test_a_strap_hinge_reaches_as_far_as_its_strap():
    solid = made("strap_hinge_90x50")
    assert extents(solid) == pytest.approx([90 + 18, 50, 10], abs=0.02)
    assert is_inside(solid, 85, 7.7, 1) and not is_inside(solid, 85, 8, 1)


def test_the_wings_of_a_weld_hinge_point_away_from_each_other():
    solid = made("weld_hinge_90x16")
    assert extents(solid) == pytest.approx([40, 16, 90], abs=0.02)
    assert is_inside(solid, 18, 0, 20) and not is_inside(solid, -18, 0, 20)
    assert is_inside(solid, -18, 0, 70) and not is_inside(solid, 18, 0, 70)


def test_a_corner_hinge_has_a_lip_at_each_side():
    solid = made("corner_hinge_70x30")
    for side in (-1, 1):
        assert is_inside(solid, side * 28, 0, -14) and not is_inside(solid, side * 24, 0, -14)
