"""Joints and levers: sizes of the standards, slots and eyes open, arms where they should point."""

import math

import pytest

from tests.parts.recipes.families.made_shapes import cylinder, extents, family, is_inside, made


def test_a_fork_head_has_the_sizes_of_din_71752():
    solid = made("clevis_10x20")  # 20 square, slot 10, 52 long, pin of 10 at 40, neck 18
    assert extents(solid) == pytest.approx([20, 20, 52])
    assert not is_inside(solid, 4.9, 0, 49) and is_inside(solid, 5.1, 0, 49)
    assert not is_inside(solid, 7.5, 4.8, 40) and is_inside(solid, 7.5, 5.2, 40)
    assert is_inside(solid, 6, 0, 19) and not is_inside(solid, 0, 8, 20.5)
    assert is_inside(solid, 8.8, 0, 3) and not is_inside(solid, 9.2, 0, 3)


def test_the_slot_of_every_fork_head_is_as_wide_as_half_its_square():
    for name in family("clevis"):
        solid = made(name)
        a = extents(solid)[0]
        top = extents(solid)[2] - 0.5
        assert not is_inside(solid, 0.245 * a, 0, top) and is_inside(solid, 0.255 * a, 0, top), name


def test_rod_ends_have_the_sizes_of_iso_12240():
    assert extents(made("rod_end_male_10")) == pytest.approx([28, 14, 48 + 14], abs=0.05)
    # The shank, 1.6 times the thread, is wider than the ball.
    assert extents(made("rod_end_female_20")) == pytest.approx([50, 32, 77 + 25], abs=0.05)


def test_rod_ends_are_bored_for_their_pin():
    for name in family("rod_end"):
        solid, d = made(name), float(name.split("_")[-1])
        for y in (-d / 3, 0.01, d / 3):
            assert not is_inside(solid, 0.48 * d, y, 0.1), name
            assert is_inside(solid, 0.53 * d, y, 0.1), name


def test_the_shank_of_an_angle_joint_stands_square_to_its_stud():
    solid = made("angle_joint_8x58")
    assert is_inside(solid, 40, 0, 0) and not is_inside(solid, 40, 0, 6.5)
    assert is_inside(solid, 0, 0, 33) and not is_inside(solid, 0, 5, 33)
    assert not is_inside(solid, 57, 0, 0)


def test_both_eyes_of_a_connecting_rod_are_open():
    solid = made("connecting_rod_72x44")
    assert extents(solid)[0] == pytest.approx(72 + 22 + 13, abs=0.05)
    assert not is_inside(solid, 13.8, 0, 0) and is_inside(solid, 14.3, 0, 0)
    assert not is_inside(solid, 72 + 6.9, 0, 0) and is_inside(solid, 72 - 7.2, 0, 0)
    assert is_inside(solid, 40, 0, 4.9) and not is_inside(solid, 40, 0, 5.1)


def test_a_lever_has_a_hub_and_a_pin_hole():
    solid = made("hub_lever_76x30")  # bore 16, 32 high; pin of 8
    assert not any(is_inside(solid, 7.8, 0, z) for z in (1, 16, 31))
    assert not is_inside(solid, 76 + 3.9, 0, 5) and is_inside(solid, 76 + 4.2, 0, 5)
    assert is_inside(solid, 14, 0, 30) and not is_inside(solid, 16, 0, 30)


def test_the_arms_of_a_bell_crank_make_their_angle():
    solid = made("bell_crank_62x50x130")
    x, y = 50 * math.cos(math.radians(130)), 50 * math.sin(math.radians(130))
    assert not is_inside(solid, x, y, 4) and is_inside(solid, 0.85 * x, 0.85 * y, 4)
    assert not is_inside(solid, 62, 0, 4) and is_inside(solid, 55, 0, 4)


def test_a_rocker_arm_is_open_along_its_axle_and_reaches_its_ends():
    solid = made("rocker_arm_64x30")
    assert not any(is_inside(solid, 9.5, y, 0.1) for y in (-14, 0, 14))
    assert is_inside(solid, 64, 0, -8) and is_inside(solid, -48, 0, -8)


def test_a_toggle_arm_weighs_like_a_bar_without_its_slot():
    expected = 98 * 22 * 16 - (98 - 3 - 30) * 8.5 * 16 - 2 * cylinder(6, 22)
    assert made("toggle_arm_98x22").mesh.volume == pytest.approx(expected, rel=0.002)
