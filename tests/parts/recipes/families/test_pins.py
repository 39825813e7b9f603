"""Keys, pins and plungers: volumes by hand, heads and holes in place."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import cylinder, extents, family, is_inside, made


def test_a_key_of_form_a_weighs_like_a_box_with_round_ends():
    solid = made("parallel_key_a20x12x125")
    assert extents(solid) == pytest.approx([125, 20, 12], abs=0.02)
    assert solid.mesh.volume == pytest.approx(12 * (105 * 20 + math.pi * 100), rel=0.001)


def test_keys_of_one_width_have_one_height():
    # DIN 6885-1, written down anew from the standard's table of cross-sections.
    heights = {8: 7, 10: 8, 12: 8, 14: 9, 16: 10, 18: 11, 20: 12, 22: 14, 25: 14, 28: 16, 32: 18}
    names = family("parallel_key")
    assert len(names) >= 25
    for name in names:
        _, width, height = sorted(extents(made(name)), reverse=True)
        assert heights[round(width)] == pytest.approx(height, abs=0.01), name


def test_a_gib_key_falls_by_one_in_a_hundred():
    solid = made("gib_key_20x12x110")
    x, y, z = extents(solid)
    assert (x, y, z) == pytest.approx((110, 20, 20), abs=0.01)
    points = np.asarray(solid.mesh.vertices)
    end = points[points[:, 0] > 109.9]
    assert np.ptp(end[:, 2]) == pytest.approx(12 - 0.98, abs=0.01)


def test_a_woodruff_key_is_a_segment_of_its_disc():
    solid = made("woodruff_key_10x13")
    r, h = 16.0, 13.0
    area = r * r * math.acos((r - h) / r) - (r - h) * math.sqrt(2 * r * h - h * h)
    assert solid.mesh.volume == pytest.approx(10 * area, rel=0.002)


def test_a_taper_pin_grows_by_one_in_fifty():
    solid = made("taper_pin_16x140")
    assert extents(solid)[0] == pytest.approx(16 + 138 / 50, abs=0.1)
    assert extents(solid)[2] == pytest.approx(140, abs=0.01)


def test_a_clevis_pin_of_form_b_has_its_hole_near_its_end():
    solid = made("clevis_pin_b20x90")  # hole of 5, 8 from the end
    assert not is_inside(solid, 4.0, 0, 82) and is_inside(solid, 4.0, 0, 78)
    assert is_inside(solid, 0, 14.5, -2.5) and not is_inside(solid, 0, 14.5, 0.5)


def test_screws_of_a_key_sink_into_it():
    solid = made("screwed_key_16x10x125")  # 80 apart, counterbores 5 deep
    for x in (-40, 40):
        assert not is_inside(solid, x, 0, 5)
        assert not is_inside(solid, x + 3.5, 0, 7) and is_inside(solid, x + 3.5, 0, 3)


def test_a_grooved_pin_has_a_neck():
    solid = made("grooved_pin_20x62")  # 62 long, groove 5 wide that ends 10 from the end, 15 thick
    assert (
        not is_inside(solid, 8.5, 0, 49.5) and is_inside(solid, 8.5, 0, 30) and is_inside(solid, 8.5, 0, 54)
    )


def test_pins_and_plungers_are_as_long_as_named_and_weigh_less_than_their_bounding_cylinder():
    for name in (*family("locating_pin"), *family("index_plunger")):
        solid = made(name)
        length = float(name.rsplit("x", 1)[1])
        x, y, z = extents(solid)
        assert z == pytest.approx(length, abs=0.01), name
        assert 0.2 * cylinder(max(x, y), z) < solid.mesh.volume < cylinder(max(x, y), z), name
