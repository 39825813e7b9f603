"""Nuts with special shapes, T-nuts and thick washers."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import made


def test_a_coupling_nut_weighs_like_a_hexagon_less_its_bore():
    expected = (math.sqrt(3) / 2 * 30**2 - math.pi / 4 * 17.294**2) * 60
    assert made("coupling_nut_m20").mesh.volume == pytest.approx(expected, rel=2e-3)


def test_a_castle_nut_weighs_like_a_nut_and_a_crown_with_six_slots():
    base = (math.sqrt(3) / 2 * 36**2 - math.pi / 4 * 20.752**2) * 19
    ring = math.pi / 4 * (34**2 - 20.752**2)
    slots = 6 * 5.5 * (34 - 20.752) / 2
    assert made("castle_nut_m24").mesh.volume == pytest.approx(base + (ring - slots) * 8, rel=0.01)


def test_a_castle_nut_looks_the_same_after_a_sixth_of_a_turn():
    mesh = made("castle_nut_m30").mesh
    top = mesh.vertices[mesh.vertices[:, 2] > mesh.bounds[1, 2] - 1e-6, :2]
    turn = np.array([[0.5, -math.sqrt(0.75)], [math.sqrt(0.75), 0.5]])
    slot_corners = top[np.hypot(*top.T) > 20.99]
    turned = slot_corners @ turn.T
    far = np.linalg.norm(turned[:, None] - slot_corners[None], axis=2).min(axis=1)
    # Facets of the round crown do not repeat every 60 degrees; the slots' edges do.
    assert np.quantile(far, 0.9) < 1.1


@pytest.mark.parametrize(
    "name",
    ["high_nut_m24", "coupling_nut_m12", "castle_nut_m16", "square_nut_m20", "flange_nut_m16", "wing_nut_m10"]
    + ["knurled_nut_m8", "t_nut_m24x28", "thick_washer_m20", "square_washer_m16"],
)
def test_nuts_have_one_hole_through(name: str):
    assert made(name).mesh.euler_number == 0


@pytest.mark.parametrize("name", ["cap_nut_m16", "c_washer_m20"])
def test_cap_nuts_are_closed_above_and_slotted_washers_open_to_the_side(name: str):
    assert made(name).mesh.euler_number == 2


@pytest.mark.parametrize(("name", "holes"), [("long_t_nut_m10x75", 2), ("long_t_nut_m16x140", 4)])
def test_a_long_t_nut_has_its_number_of_holes(name: str, holes: int):
    assert made(name).mesh.euler_number == 2 - 2 * holes


def test_a_long_t_nut_weighs_like_two_bars_less_its_holes():
    expected = (22 * 8 + 14 * 8) * 80 - 3 * math.pi / 4 * 10.106**2 * 16
    assert made("long_t_nut_m12x80").mesh.volume == pytest.approx(expected, rel=2e-3)


def test_a_cap_nut_is_a_hexagon_a_cylinder_and_half_a_ball_less_the_bore():
    radius, hexagon = 14.0, math.sqrt(3) / 2 * 30**2 * 16
    dome = math.pi * radius**2 * (34 - 16 - radius) + 2 / 3 * math.pi * radius**3
    bore = math.pi / 4 * 17.294**2 * 26
    mesh = made("cap_nut_m20").mesh
    assert mesh.volume == pytest.approx(hexagon + dome - bore, rel=0.01)
    assert mesh.extents[2] == pytest.approx(34)


def test_a_wing_nut_spans_what_the_standard_says():
    mesh = made("wing_nut_m16").mesh
    assert mesh.extents[0] == pytest.approx(71.5, abs=0.02)
    assert mesh.extents[2] == pytest.approx(36.25, abs=0.02)


def test_a_high_nut_s_seat_stands_out_at_the_bore():
    mesh = made("high_nut_m30").mesh
    low = mesh.vertices[mesh.vertices[:, 2] < 1e-6]
    assert np.hypot(*low[:, :2].T).max() == pytest.approx(26.211 / 2, abs=0.01)
    assert mesh.extents[2] == pytest.approx(45)


def test_a_slotted_washer_weighs_like_a_disc_less_a_slot():
    strip = 12.5 * math.sqrt(32.5**2 - 12.5**2) + 32.5**2 * math.asin(12.5 / 32.5)
    expected = (math.pi * 32.5**2 - math.pi * 12.5**2 / 2 - strip) * 10
    assert made("c_washer_m24").mesh.volume == pytest.approx(expected, rel=0.01)
