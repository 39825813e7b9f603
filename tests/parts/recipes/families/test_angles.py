"""Brackets: weights by hand, holes and slots open, both legs alike where they are equal."""

import math

import pytest

from tests.parts.recipes.families.made_shapes import cylinder, extents, is_inside, made


def test_a_ribbed_bracket_weighs_like_two_legs_and_a_triangle():
    solid = made("ribbed_bracket_60x60x30")
    legs, gusset, holes = (60 + 55) * 5 * 30, 46 * 46 / 2 * 4, 4 * cylinder(4.5, 5)
    assert solid.mesh.volume == pytest.approx(legs + gusset - holes, rel=0.002)
    assert extents(solid) == pytest.approx([60, 30, 60])


def test_a_profile_angle_weighs_like_two_legs_and_two_cheeks():
    solid = made("profile_angle_38x38x38")
    cheek = 37 * 37 - 27 * 27 / 2 - (37 + 32) * 5
    expected = (38 + 33) * 5 * 38 + 2 * 4 * cheek - 2 * cylinder(8.4, 5)
    assert solid.mesh.volume == pytest.approx(expected, rel=0.002)
    assert is_inside(solid, 10, 17, 10) and not is_inside(solid, 10, 0, 10)


def test_slots_of_a_bracket_are_open_and_as_wide_as_the_table_says():
    solid = made("slotted_bracket_60x40")
    for x in (16, 32, 48):
        assert not is_inside(solid, x, 3.2, 2) and is_inside(solid, x, 3.4, 2)
    assert not is_inside(solid, 2, 0, 22) and is_inside(solid, 2, 3.4, 22)


def test_a_drilled_angle_has_its_holes_in_both_legs():
    solid = made("drilled_angle_25x25x100")
    assert solid.mesh.volume == pytest.approx((25 + 21) * 4 * 100 - 6 * cylinder(5.5, 4), rel=0.002)
    assert solid.mesh.euler_number == 2 - 2 * 6


def test_a_z_bracket_has_legs_that_point_away_from_each_other():
    solid = made("z_bracket_40x30x40")
    assert extents(solid) == pytest.approx([76, 40, 30])
    expected = 2 * 40 * 40 * 4 + 22 * 40 * 4 - 2 * cylinder(11, 4)
    assert solid.mesh.volume == pytest.approx(expected, rel=0.002)
    assert is_inside(solid, 35, 0, 2) and is_inside(solid, -31, 0, 28)


def test_a_hat_bracket_is_symmetric_and_its_walls_lean_by_ten_degrees():
    solid = made("hat_bracket_50x28x60")
    run = 25 * math.tan(math.radians(10))
    assert extents(solid) == pytest.approx([50 + 2 * run + 2 * 22, 60, 28], abs=0.05)
    assert solid.mesh.center_mass[:2] == pytest.approx([0, 0], abs=1e-6)


def test_the_bore_of_a_fork_bracket_goes_through_both_cheeks():
    solid = made("fork_bracket_80x55x44")
    for y in (-20, 20):
        assert not is_inside(solid, 5.9, y, 40) and is_inside(solid, 6.2, y, 40)
    assert not is_inside(solid, 10, 0, 40)
