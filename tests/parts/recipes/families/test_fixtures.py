"""Workholding: weights by hand, slots and bores open."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import cylinder, extents, family, is_inside, made


def test_a_v_block_has_a_v_of_90_degrees():
    solid = made("v_block_40x36x76")  # 28 wide at the top
    for depth in (2, 6, 10):
        half = 14 - depth
        assert not is_inside(solid, 38, half - 0.3, 36 - depth)
        assert is_inside(solid, 38, half + 0.3, 36 - depth)
    assert not is_inside(solid, 38, 18, 0.3 * 36 + 3)


def test_a_step_block_weighs_like_its_stairs():
    heights = 7.5, 15, 22.5, 30
    assert made("step_block_40x30x20").mesh.volume == pytest.approx(10 * 20 * sum(heights), rel=1e-6)


def test_a_soft_jaw_weighs_like_a_block_with_a_step_and_two_holes():
    expected = (25 * 45 - 5 * 5) * 100 - 2 * cylinder(9, 25)
    assert made("soft_jaw_100x45x25").mesh.volume == pytest.approx(expected, rel=0.002)


def test_a_finger_has_a_v_in_its_pad():
    solid = made("gripper_finger_40x92")  # tip 6, pad 26 high, V 4 deep
    assert not is_inside(solid, -5.5, 0, 92 - 13) and is_inside(solid, -1.5, 0, 92 - 13)
    assert is_inside(solid, -5.5, 0, 92 - 3) and is_inside(solid, -5.5, 0, 92 - 23)


def test_the_slot_of_a_clamp_strap_is_open():
    solid = made("clamp_strap_94x30")
    assert not is_inside(solid, 45, 5.4, 7) and is_inside(solid, 45, 5.7, 7)
    assert is_inside(solid, 5, 0, -13) and not is_inside(solid, 20, 0, -1)


def test_a_saddle_weighs_like_half_a_ring_and_two_feet():
    ring = math.pi / 2 * (13.5**2 - 11**2) * 20
    feet = 2 * (31.5 - 13.42) * 2.5 * 20 - 2 * cylinder(5.5, 2.5)
    assert made("saddle_clamp_22x20").mesh.volume == pytest.approx(ring + feet, rel=0.01)


def test_rings_and_clamps_are_open_for_what_they_hold():
    for kind in ("p_clip", "pipe_clamp"):
        for name in family(kind):
            solid = made(name)
            radius, half = float(name.split("_")[-1].split("x")[0]) / 2, extents(solid)[1] / 2
            for y in np.linspace(-0.95 * half, 0.95 * half, 4):
                assert not is_inside(solid, 0.1, y, 0.97 * radius), name
                assert not is_inside(solid, 0.1, y, -0.97 * radius), name


def test_a_split_clamp_is_slit_from_its_bore():
    solid = made("split_clamp_20x76")  # 36 wide, 20 thick, slit 2.5 wide
    assert not is_inside(solid, 9.8, 0, 0) and not is_inside(solid, 20, 1.2, 0)
    assert is_inside(solid, 20, 1.4, 3.5) and is_inside(solid, 57.5, 15, 9)
