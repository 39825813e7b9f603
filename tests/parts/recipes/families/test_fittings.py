"""Straight fittings: weights by hand, open or blind as they should be."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import cylinder, extents, family, is_inside, made


def hexagon(across_flats: float, length: float) -> float:
    return math.sqrt(3) / 2 * across_flats**2 * length


def test_a_nipple_weighs_like_two_threads_and_a_hexagon():
    expected = cylinder(13.157, 34 - 7) + hexagon(17, 7) - cylinder(8, 34)
    assert made("hex_nipple_17x34").mesh.volume == pytest.approx(expected, rel=0.003)


def test_a_plug_weighs_like_thread_collar_and_square():
    expected = cylinder(20.955, 21) + cylinder(28, 4) + 11 * 11 * 11
    assert made("square_plug_11x36").mesh.volume == pytest.approx(expected, rel=0.003)


@pytest.mark.slow
def test_fittings_are_open_from_end_to_end():
    names = [*family("hex_nipple"), *family("pipe_union"), *family("hose_barb"), *family("cable_gland")]
    names += [*family("kf_flange"), *family("neck_flange"), *family("check_valve")]
    assert len(names) > 40
    for name in names:
        solid = made(name)
        high = solid.mesh.bounds[1][2]
        assert not any(is_inside(solid, 0.1, 0.2, z) for z in np.linspace(0.1, high - 0.1, 6)), name


def test_a_cap_is_closed_above_its_bore():
    solid = made("pipe_cap_27x26")  # bored 19 wide and 16 deep
    assert not is_inside(solid, 9.3, 0, 15.8) and is_inside(solid, 0.1, 0, 16.3)


def test_a_union_has_its_nut_in_the_middle():
    solid = made("pipe_union_27x54")
    assert extents(solid) == pytest.approx([40 * 2 / math.sqrt(3), 40, 54], abs=0.02)


def test_a_kf_flange_has_the_diameter_of_iso_2861():
    for nominal, outer in ((10, 30), (16, 30), (25, 40), (40, 55)):
        names = [name for name in family("kf_flange") if name.startswith(f"kf_flange_{nominal}x")]
        assert names
        assert all(extents(made(name))[0] == pytest.approx(outer, abs=0.01) for name in names)


def test_a_neck_flange_has_four_bolt_holes():
    solid = made("neck_flange_26p9x78")  # 55 bolt circle, holes 9
    at = 27.5 / math.sqrt(2)
    for x, y in ((at, at), (-at, at), (-at, -at), (at, -at)):
        assert not is_inside(solid, x, y, 5)
    assert solid.mesh.euler_number == 2 - 2 * 5


def test_a_ball_valve_is_open_along_its_pipe_and_its_lever_lies_along_it():
    solid = made("ball_valve_58x84")  # bore 18
    assert not any(is_inside(solid, x, 8.9, 0) for x in (-28, 0.1, 28))
    assert is_inside(solid, 80, 0, 38) and not is_inside(solid, 80, 0, 30)


def test_a_needle_valve_is_bored_from_both_ends_and_closed_in_between():
    solid = made("needle_valve_58x62")
    assert not is_inside(solid, 28, 0, 0) and not is_inside(solid, -28, 0, 0)
    assert is_inside(solid, 0.1, 0, 0) and is_inside(solid, 14, 0, 60)
