"""Brackets, hinges and pillow blocks: volumes of the formula, open bores."""

import pytest

from tests.parts.recipes.families.made_shapes import cylinder, extents, is_inside, made


def test_an_l_bracket_weighs_like_two_legs_a_weld_and_no_holes():
    legs = 60 * 40 * 6 + (40 - 6) * 40 * 6 + 6 * 6 / 2 * 40
    solid = made("l_bracket_60x40")
    assert extents(solid) == pytest.approx([60, 40, 40])
    assert solid.mesh.volume == pytest.approx(legs - 2 * cylinder(13, 6), rel=1e-3)


def test_a_u_bracket_is_a_channel_with_a_hole_in_its_base():
    solid = made("u_bracket_60x35")
    channel = 60 * (45 * 4 + 2 * (35 - 4) * 4)
    assert solid.mesh.volume == pytest.approx(channel - cylinder(16, 4), rel=1e-3)
    assert is_inside(solid, 25, 21, 30) and not is_inside(solid, 0, 0.3, 30)


def test_a_hinge_has_two_leaves_at_right_angles():
    solid = made("hinge_60x30")
    assert extents(solid) == pytest.approx([35, 60, 35], rel=1e-3)
    assert not is_inside(solid, 20, 0.3, 20)
    assert is_inside(solid, 25, 0.3, -4) and is_inside(solid, -4, 0.3, 25)


def test_a_pillow_block_is_bored_along_y():
    solid = made("pillow_block_80x32")
    assert extents(solid)[0] == pytest.approx(80)
    assert not is_inside(solid, 0.2, 0.3, 32)
    assert is_inside(solid, 17, 0.3, 32) and not is_inside(solid, 38, 0.3, 4)
