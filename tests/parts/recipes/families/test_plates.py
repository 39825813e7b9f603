"""Flat connecting parts: weights by hand, as many holes as the table says, eyes open."""

import math

import pytest

from mskgrasp.parts.recipes.recipe import table
from tests.parts.recipes.families.made_shapes import cylinder, extents, family, is_inside, made


def test_a_t_plate_weighs_like_two_bars_with_round_corners():
    solid = made("t_plate_100x70x30")
    area = 100 * 30 + 30 * 40 - 6 * (1 - math.pi / 4) * 9
    assert solid.mesh.volume == pytest.approx(area * 6 - 4 * cylinder(6.6, 6), rel=0.002)


def test_a_corner_plate_weighs_like_two_bars_with_round_corners():
    solid = made("corner_plate_90x50x25")
    area = 90 * 25 + 25 * 25 - 5 * (1 - math.pi / 4) * 16
    assert solid.mesh.volume == pytest.approx(area * 5 - 4 * cylinder(6.6, 5), rel=0.002)


def test_a_y_plate_looks_the_same_from_three_sides():
    for name in family("y_plate"):
        assert made(name).mesh.center_mass[:2] == pytest.approx([0, 0], abs=1e-3), name


def test_bars_have_as_many_holes_as_the_table_says():
    for row in table("drilled_bar.csv"):
        solid = made(f"drilled_bar_{row['l_mm']:g}x{row['w_mm']:g}x{row['t_mm']:g}")
        assert solid.mesh.euler_number == 2 - 2 * row["holes"]
    assert made("slotted_bar_92x20").mesh.euler_number == 2 - 2 * 3  # two slots, one bore


def test_a_drilled_bar_weighs_like_a_bar_without_its_holes():
    expected = 72 * 30 * 10 - 2 * cylinder(13, 10)
    assert made("drilled_bar_72x30x10").mesh.volume == pytest.approx(expected, rel=0.002)


def test_the_eyes_of_a_link_are_open_and_its_waist_is_not():
    solid = made("link_plate_60x32")
    assert extents(solid) == pytest.approx([92, 32, 8], abs=0.02)
    for x in (-30, 30):
        assert not is_inside(solid, x + 7.8, 0, 4) and is_inside(solid, x, 8.2, 4)
    assert is_inside(solid, 0, 9.8, 4) and not is_inside(solid, 0, 10.2, 4)


def test_an_offset_bar_is_level_at_both_ends_and_as_thick_in_between():
    solid = made("offset_bar_98x40x14")  # 6 thick
    assert extents(solid) == pytest.approx([98, 40, 20], abs=0.01)
    assert is_inside(solid, -48, 15, 5.9) and is_inside(solid, 48, 15, 14.1)
    across = [step / 10 for step in range(-100, 101) if is_inside(solid, step / 10, 15, 7 + 3 * 0.7)]
    assert (max(across) - min(across)) / math.sqrt(2) == pytest.approx(6, abs=0.2)


def test_a_gusset_weighs_like_its_outline():
    area = 80 * 55 - 70 * 45 / 2 - 12 * 12 / 2
    solid = made("gusset_plate_80x55x6")
    assert solid.mesh.volume == pytest.approx(area * 6 - 2 * cylinder(5.5, 6), rel=0.002)


def test_the_eye_of_a_lifting_lug_is_open():
    solid = made("lifting_lug_92x58")  # eye of 38 with a bore of 18, its centre 39 above the ground
    assert not is_inside(solid, 8.9, 0, 39) and is_inside(solid, 9.2, 0, 39)
    assert extents(solid) == pytest.approx([92, 40, 58], abs=0.02)
