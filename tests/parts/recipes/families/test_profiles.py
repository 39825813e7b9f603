"""Profiles: cross-sections by hand, slots open, undercuts where they should be."""

import math

import pytest

from tests.parts.recipes.families.made_shapes import cylinder, extents, is_inside, made


@pytest.mark.parametrize(
    ("name", "area"),
    [
        ("channel_40x20x130", 40 * 3 + 2 * 17 * 3),
        ("angle_profile_40x20x92", 40 * 4 + 16 * 4),
        ("tee_profile_30x30x95", 30 * 4 + 26 * 4),
        ("i_beam_30x40x112", 2 * 30 * 4 + 32 * 4),
        ("din_rail_35x7p5x68", 27 * 1 + 2 * 6.5 * 1 + 2 * 4 * 1),
        ("lipped_channel_41x21x140", 41 * 2 + 2 * 19 * 2 + 2 * 7.5 * 2 + 2 * 4 * 2),
    ],
)
def test_a_profile_weighs_like_its_cross_section(name, area):
    length = float(name.split("x")[-1])
    assert made(name).mesh.volume == pytest.approx(area * length, rel=1e-4)


def test_a_square_tube_weighs_like_its_walls():
    expected = (30 * 30 - 26 * 26) * 75 - 2 * cylinder(9, 2)
    assert made("square_tube_30x30x75").mesh.volume == pytest.approx(expected, rel=0.002)


def test_a_slotted_profile_has_a_t_slot_in_every_side():
    solid = made("slot_profile_40x40x80")
    assert extents(solid) == pytest.approx([80, 40, 40])
    for a, b in ((0, 19), (8, 14.5), (0, 8.5)):  # mouth, undercut, bottom
        for y, z in ((a, b), (-a, -b), (b, -a), (-b, a)):
            assert not is_inside(solid, 40, y, z)
    for y, z in ((8, 18), (18, 18), (5, 5), (-18, 8)):  # lip, corner, core, lip
        assert is_inside(solid, 40, y, z)
    assert not is_inside(solid, 40, 3.2, 0)  # core hole of 6.8


def test_a_double_profile_has_six_slots():
    solid = made("slot_profile_60x30x110")
    mouths = [(-15, 14), (15, 14), (-15, -14), (15, -14), (29, 0), (-29, 0)]
    assert not any(is_inside(solid, 55, y, z) for y, z in mouths)
    assert is_inside(solid, 55, 0, 14)


def test_a_dovetail_is_wider_above_than_at_its_neck():
    solid = made("dovetail_rail_30x16x112")
    half = 7.5 + 9 / math.tan(math.radians(60))
    assert is_inside(solid, 50, half - 0.2, 15.9) and not is_inside(solid, 50, half - 0.2, 14)
    assert is_inside(solid, 50, 7.3, 7.2) and not is_inside(solid, 50, 8.5, 7.2)


def test_the_grooves_of_a_rail_face_each_other():
    solid = made("linear_rail_20x17p5x110")
    low, high = 0.5 * 17.5, 0.85 * 17.5
    for y in (-9, 9):
        assert not is_inside(solid, 55, y, (low + high) / 2) and is_inside(solid, 55, y, low - 1)
    assert solid.mesh.center_mass[1] == pytest.approx(0, abs=1e-6)
