"""Standoffs, studs and levelling feet."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import made


def test_a_standoff_weighs_like_a_hexagon_with_a_stud_less_its_bore():
    hexagon, stud = math.sqrt(3) / 2 * 13**2 * 65, math.pi * 4**2 * 15
    bore = math.pi / 4 * 6.647**2 * 14
    mesh = made("standoff_mf_m8x65").mesh
    assert mesh.volume == pytest.approx(hexagon + stud - bore, rel=0.01)
    assert mesh.extents[2] == pytest.approx(80)


def test_a_female_standoff_is_the_same_from_both_ends():
    mesh = made("standoff_ff_m6x65").mesh
    assert mesh.volume == pytest.approx(math.sqrt(3) / 2 * 100 * 65 - math.pi / 4 * 4.917**2 * 24, rel=0.01)
    assert mesh.center_mass == pytest.approx([0, 0, 32.5], abs=1e-3)
    assert mesh.euler_number == 2


def test_a_round_standoff_has_two_flats_at_its_foot():
    mesh = made("round_standoff_25x80").mesh
    assert mesh.extents[1] == pytest.approx(25, abs=0.01)
    chord = math.sqrt(12.5**2 - 10.5**2)
    segment = 12.5**2 * math.acos(10.5 / 12.5) - 10.5 * chord
    expected = math.pi * 12.5**2 * 80 - 2 * segment * 12.5 + math.pi * 6**2 * 22
    assert mesh.volume == pytest.approx(expected, rel=0.005)


def test_a_hex_stud_is_symmetric_and_as_long_as_it_says():
    mesh = made("hex_stud_m16x135").mesh
    assert mesh.extents[2] == pytest.approx(135)
    assert mesh.center_mass == pytest.approx([0, 0, 0], abs=1e-3)
    expected = math.sqrt(3) / 2 * 24**2 * 20 + math.pi * 64 * 115
    assert mesh.volume == pytest.approx(expected, rel=0.01)


def test_a_waisted_stud_is_thinner_between_its_threads():
    mesh = made("waisted_stud_m20x105").mesh
    middle = mesh.vertices[np.abs(mesh.vertices[:, 2]) < 20.5]
    assert np.hypot(*middle[:, :2].T).max() == pytest.approx(7.5, abs=0.01)
    assert mesh.extents == pytest.approx([20, 20, 105], abs=0.02)


def test_feet_stand_flat_on_their_plates_and_are_as_high_as_they_say():
    for name, width, height in (("levelling_foot_60xm16x115", 60, 115), ("locking_foot_90xm16x100", 90, 100)):
        mesh = made(name).mesh
        assert mesh.extents[0] == pytest.approx(width, abs=0.05)
        assert mesh.extents[2] == pytest.approx(height)
        assert mesh.bounds[0, 2] == pytest.approx(0)


def test_a_locking_foot_has_two_bolt_holes():
    assert made("locking_foot_90xm16x100").mesh.euler_number == 2 - 2 * 2


def test_a_plastic_pillar_has_four_ribs():
    mesh = made("plastic_pillar_16x80").mesh
    points = mesh.vertices[(mesh.vertices[:, 2] > 3.99) & (mesh.vertices[:, 2] < 4.01)]
    outer = points[np.abs(np.hypot(*points[:, :2].T) - 18) < 0.3]
    angles = np.degrees(np.arctan2(outer[:, 1], outer[:, 0])) % 360
    assert {int(round(a / 90)) % 4 for a in angles} == {0, 1, 2, 3}
