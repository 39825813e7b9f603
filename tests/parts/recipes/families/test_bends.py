"""Parts bent from round bar."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import made


def test_a_u_bolt_weighs_like_two_legs_and_half_a_torus():
    # Bar 10, legs 43 apart: the bend's centre line has a radius of 26.5, legs are 72 - 26.5 - 5 long.
    area = math.pi * 5**2
    expected = area * (2 * (72 - 26.5 - 5) + math.pi * 26.5)
    mesh = made("u_bolt_m10x43x72").mesh
    assert mesh.volume == pytest.approx(expected, rel=0.01)
    assert np.sort(mesh.extents) == pytest.approx([10, 63, 72], abs=0.05)


def test_a_u_bolt_leaves_its_width_between_the_legs():
    mesh = made("u_bolt_m12x50x125").mesh
    legs = mesh.vertices[mesh.vertices[:, 0] < 40]
    assert np.abs(legs[:, 1]).min() == pytest.approx(25, abs=0.02)


def test_a_u_bolt_with_its_strap_encloses_one_opening():
    assert made("u_bolt_m8x28x90").mesh.euler_number == 2
    assert made("u_bolt_nuts_m8x27x65").mesh.euler_number == 0


def test_a_square_u_bolt_weighs_like_five_pieces_of_bar():
    area, half, bend = math.pi * 4**2, (40 + 8) / 2, 11
    leg, bridge = 100 - 4 - bend, 2 * (half - bend)
    expected = area * (2 * leg + bridge + math.pi * bend)
    mesh = made("square_u_bolt_m8x40x100").mesh
    assert mesh.volume == pytest.approx(expected, rel=0.01)
    assert np.sort(mesh.extents) == pytest.approx([8, 56, 100], abs=0.05)


def test_hook_bolts_weigh_like_straight_bar_of_their_centre_line():
    j, foot = math.pi * 5**2 * (105 + math.pi * 22 + 12), math.pi * 6**2 * (95 + math.pi / 2 * 18 + 20)
    assert made("j_bolt_m10x105").mesh.volume == pytest.approx(j, rel=0.01)
    assert made("l_bolt_m12x95").mesh.volume == pytest.approx(foot, rel=0.01)


def test_an_s_hook_is_the_same_after_half_a_turn():
    mesh = made("s_hook_6x16").mesh
    middle = mesh.center_mass
    turned = 2 * middle - mesh.bounds[::-1]
    assert turned == pytest.approx(mesh.bounds, abs=0.1)
    length = math.pi * 6**2 / 4 * (25 + 2 * math.radians(200) * 16)
    assert mesh.volume == pytest.approx(length, rel=0.01)


@pytest.mark.parametrize(("name", "openings"), [("screw_hook_m10x18", 0), ("eye_hook_8x16", 1)])
def test_hooks_stay_open(name: str, openings: int):
    assert made(name).mesh.euler_number == 2 - 2 * openings


def test_hooks_taper_towards_the_tip():
    mesh = made("screw_hook_m12x26").mesh
    assert mesh.bounds[1, 2] == pytest.approx(1.1 * 12, abs=0.05)  # the collar is the widest
    tip = mesh.vertices[(mesh.vertices[:, 1] > mesh.bounds[1, 1] - 3) & (mesh.vertices[:, 0] > 0)]
    assert 0.7 * 0.55 * 12 * 0.9 < np.abs(tip[:, 2]).max() < 0.55 * 12
