"""Shafts: seats, keyways, flats and splines where they should be."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import cylinder, extents, family, is_inside, made


def test_a_pivot_weighs_like_its_two_seats():
    solid = made("two_step_shaft_30x30x75")
    assert extents(solid) == pytest.approx([30, 30, 105], abs=0.05)
    assert solid.mesh.volume == pytest.approx(cylinder(30, 30) + cylinder(20, 75), rel=0.005)


def test_a_keyway_takes_its_depth_and_round_ends_out_of_the_seat():
    solid = made("keyed_shaft_28x20x28")  # seat of 25 from z = 27 to 55, keyway 8 x 4 x 22 in its middle
    assert not is_inside(solid, 12.5 - 3.9, 0, 41)
    assert is_inside(solid, 12.5 - 4.1, 0, 41)
    assert is_inside(solid, 12.0, 0, 28) and not is_inside(solid, 11.9, 3.9, 41)
    plain = sum(cylinder(d, length) for d, length in ((17, 18), (28, 10), (25, 28), (20, 22), (15, 24)))
    cut = (14 * 8 + math.pi * 16) * (4 - 0.43)  # above a chord of 8 the circle of 25 rises by 0.43 on average
    assert solid.mesh.volume == pytest.approx(plain - cut, rel=0.005)


def test_flats_leave_what_a_spanner_needs():
    solid = made("flatted_shaft_25x140")  # 20 across the lower flat, 21 across the upper two, 40 long
    assert is_inside(solid, 7.4, 0, 20) and not is_inside(solid, 7.6, 0, 20)
    assert is_inside(solid, -12.4, 0, 20)
    assert is_inside(solid, 10.4, 0, 120) and not is_inside(solid, 10.6, 0, 120)
    assert not is_inside(solid, -10.6, 0, 120) and is_inside(solid, 12.4, 0, 70)


def test_a_hollow_shaft_is_open_along_its_axis():
    for name in family("hollow_shaft"):
        solid = made(name)
        assert not any(is_inside(solid, 0, 0, z) for z in np.linspace(0.5, extents(solid)[2] - 0.5, 7)), name


def test_hulls_of_a_hollow_shaft_leave_its_steps_free():
    solid = made("hollow_shaft_60x32x36")  # 60 thick between z = 16 and 52 only
    for points in solid.hulls:
        if points[:, 2].min() < 15 or points[:, 2].max() > 53:
            assert np.hypot(points[:, 0], points[:, 1]).max() < 23


def test_a_taper_of_one_to_ten_loses_a_tenth_of_its_length_in_diameter():
    solid = made("taper_shaft_30x50")  # seat 50, collar 10, taper 50 from 30 to 25
    assert is_inside(solid, 12.45, 0, 109.5) and not is_inside(solid, 12.6, 0, 109.5)


def test_splines_are_as_many_and_as_wide_as_their_name_says():
    solid = made("splined_shaft_8x36x42x85")  # ISO 14: teeth 7 wide
    angles = np.radians(np.arange(0, 360, 1))
    inside = np.array([is_inside(solid, 20 * np.cos(a), 20 * np.sin(a), 40) for a in angles])
    assert np.count_nonzero(np.diff(np.append(inside, inside[:1]).astype(int)) == 1) == 8
    assert inside.mean() == pytest.approx(8 * 7 / (2 * math.pi * 20), abs=0.05)
