"""Supports: bores where they should be, slits open, weights by hand."""

import numpy as np
import pytest

from mskgrasp.parts.recipes.recipe import table
from tests.parts.recipes.families.made_shapes import cylinder, extents, family, is_inside, made


def test_a_shaft_support_is_bored_at_its_height_and_slit_above():
    solid = made("shaft_support_20x60")
    assert extents(solid) == pytest.approx([60, 20, 51])
    assert not is_inside(solid, 9.9, 0, 31) and is_inside(solid, 10.2, 0, 31)
    assert not is_inside(solid, 0, 0, 46) and is_inside(solid, 2, 0, 46)
    assert is_inside(solid, 0, 0, 15)


def test_flanges_are_open_along_their_axis():
    for name in (*family("flange_support"), *family("flange_housing"), *family("square_mount")):
        solid = made(name)
        high = extents(solid)[2]
        assert not any(is_inside(solid, 0.1, 0.2, z) for z in np.linspace(0.2, high - 0.2, 5)), name


def test_a_flange_support_has_its_ears_and_its_boss():
    solid = made("flange_support_20x60")
    assert extents(solid) == pytest.approx([60, 37, 24], abs=0.05)
    assert is_inside(solid, 13, 5, 20) and not is_inside(solid, 17.5, 0, 20)
    assert not is_inside(solid, -13, 0, 20)  # the slit


def test_a_linear_block_weighs_like_its_section():
    solid = made("linear_block_12x30x26")
    area = 30 * 20 - 4 * 9 - cylinder(12, 1)
    assert solid.mesh.volume == pytest.approx(area * 26 - 4 * cylinder(3.3, 2.5 * 1.65), rel=0.003)


def test_carriages_straddle_their_rail():
    for row in table("carriage.csv"):
        name = f"carriage_{row['a_mm']:g}x{row['b_mm']:g}x{row['l_mm']:g}".replace(".", "p")
        solid = made(name)
        assert extents(solid) == pytest.approx([row["l_mm"], row["a_mm"], row["b_mm"]])
        inside_groove = row["deep_mm"] - 0.2
        assert not is_inside(solid, 0.1, 0.45 * row["rail_mm"], inside_groove), name
        assert is_inside(solid, 0.1, 0.1, row["deep_mm"] + 0.2), name
        assert is_inside(solid, 0.1, row["rail_mm"] / 2 + 0.3, inside_groove), name


def test_a_slide_fits_over_its_dovetail():
    solid = made("dovetail_slide_42x24x82")  # neck 18, 10 deep
    assert not is_inside(solid, 40, 13, 9.5) and is_inside(solid, 40, 13, 2)
    assert not is_inside(solid, 40, 8.8, 0.5) and is_inside(solid, 40, 0.3, 10.3)


def test_a_nut_block_is_bored_along_the_screw():
    solid = made("screw_nut_block_22x30")
    assert extents(solid) == pytest.approx([60, 30, 36])
    for y in (-14, 0, 14):
        assert not is_inside(solid, 10.9, y, 18) and is_inside(solid, 11.2, y, 18)
