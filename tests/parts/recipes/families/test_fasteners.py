"""Bolts, screws, nuts and washers of the commonest standards."""

import math

import numpy as np
import pytest

from mskgrasp.parts.recipes.families import fasteners
from tests.parts.recipes.families.made_shapes import made


def test_a_long_bolt_weighs_like_its_head_and_shank():
    head, shank = math.sqrt(3) / 2 * 24**2 * 10, math.pi * 8**2 * 100
    assert made("hex_bolt_m16x100").mesh.volume == pytest.approx(head + shank, rel=0.02)  # chamfers


def test_a_socket_screw_weighs_like_two_cylinders_less_the_socket():
    head, shank = math.pi * 18**2 * 24, math.pi * 12**2 * 70
    socket = math.sqrt(3) / 2 * 19**2 * 12
    assert made("socket_screw_m24x70").mesh.volume == pytest.approx(head + shank - socket, rel=0.02)


def test_an_m20_bolt_of_80_is_92_5_long_and_30_wide():
    extents = np.sort(made("hex_bolt_m20x80").mesh.extents)
    assert extents[2] == pytest.approx(92.5)
    assert extents[0] == pytest.approx(30, abs=0.01)


def test_a_nut_weighs_like_a_hexagon_less_its_bore():
    expected = (math.sqrt(3) / 2 * 36**2 - math.pi / 4 * 20.752**2) * 21.5
    assert made("hex_nut_m24").mesh.volume == pytest.approx(expected, rel=0.02)  # chamfers


def test_a_thin_nut_is_half_as_high_as_its_thread_is_wide():
    for d in (24, 30, 36, 42):
        assert np.min(made(f"thin_nut_m{d}").mesh.extents) == pytest.approx(d / 2)


@pytest.mark.parametrize("name", ["hex_nut_m16", "thin_nut_m30", "washer_m24", "large_washer_m20"])
def test_nuts_and_washers_have_one_hole_through(name: str):
    assert made(name).mesh.euler_number == 0


def test_washers_weigh_like_rings():
    assert made("washer_m30").mesh.volume == pytest.approx(math.pi * (28**2 - 15.5**2) * 4, rel=2e-3)
    assert made("large_washer_m24").mesh.volume == pytest.approx(math.pi * (36**2 - 13**2) * 5, rel=2e-3)


def test_lengths_of_one_thread_differ_by_six_per_cent_or_more():
    for lengths in (*fasteners.HEX_BOLTS.values(), *fasteners.SOCKET_SCREWS.values()):
        assert all(b >= 1.06 * a for a, b in zip(lengths, lengths[1:], strict=False))
