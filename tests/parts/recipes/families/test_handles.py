"""Handles, levers and cranks."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import made


def test_a_pull_handle_weighs_like_its_bar_and_two_flanges():
    area, bend = math.pi * 5**2, 18
    bar = area * (2 * (55 - bend - 5) + (110 - 2 * bend) + math.pi * bend)
    flanges = 2 * (math.pi * 10**2 * 3 + math.pi / 3 * 2 * (10**2 + 10 * 8 + 8**2))
    hidden = 2 * area * 5
    mesh = made("pull_handle_10x110").mesh
    assert mesh.volume == pytest.approx(bar + flanges - hidden, rel=0.01)
    assert mesh.bounds[:, 2] == pytest.approx([0, 55], abs=0.02)


def test_a_bridge_handle_encloses_no_opening_until_it_is_mounted():
    mesh = made("bridge_handle_120x42").mesh
    assert mesh.euler_number == 2
    assert mesh.extents[0] == pytest.approx(120)
    assert mesh.center_mass[:2] == pytest.approx([0, 0], abs=1e-3)


def test_a_bow_handle_stands_on_two_feet():
    mesh = made("bow_handle_110x38x26").mesh
    assert mesh.extents == pytest.approx([110, 26, 38], abs=0.05)
    feet = mesh.vertices[mesh.vertices[:, 2] < 1e-6]
    assert np.abs(feet[:, 0]).min() == pytest.approx(55 - 20, abs=0.3)
    assert mesh.center_mass[:2] == pytest.approx([0, 0], abs=0.02)


@pytest.mark.parametrize(
    ("name", "holes"), [("ball_lever_80x25", 1), ("flat_lever_80x32", 2), ("crank_80x30", 1)]
)
def test_levers_have_open_bores(name: str, holes: int):
    assert made(name).mesh.euler_number == 2 - 2 * holes


def test_a_ball_lever_s_bore_is_clear():
    mesh = made("ball_lever_60x20").mesh
    hub = mesh.vertices[np.abs(mesh.vertices[:, 2]) <= 10]
    assert np.hypot(*hub[:, :2].T).min() == pytest.approx(6, abs=0.01)


def test_a_flat_lever_is_as_long_as_its_centres_and_both_ends():
    mesh = made("flat_lever_92x36").mesh
    assert mesh.extents[0] == pytest.approx(92 + 18 + 12, abs=0.05)
    assert mesh.extents[2] == pytest.approx(30)


def test_a_machine_handle_is_thickest_in_its_upper_half():
    mesh = made("machine_handle_25x80").mesh
    radius = np.hypot(*mesh.vertices[:, :2].T)
    assert radius.max() == pytest.approx(12.5, abs=0.02)
    assert 40 < mesh.vertices[radius.argmax(), 2] < 70
    assert mesh.bounds[:, 2] == pytest.approx([-18, 80])


def test_a_cylinder_grip_has_three_grooves():
    mesh = made("cylinder_grip_26x90").mesh
    radius = np.hypot(*mesh.vertices[:, :2].T)
    for share in (0.25, 0.5, 0.75):
        near = np.abs(mesh.vertices[:, 2] - share * 90) < 1
        outer = 13 * (1 - 0.12 * share)
        assert radius[near].max() == pytest.approx(outer - 1.6, abs=0.1)


def test_a_clamping_lever_rises_by_15_degrees():
    mesh = made("clamping_lever_78xm10x35").mesh
    tip = mesh.vertices[mesh.vertices[:, 0] > mesh.bounds[1, 0] - 5]
    assert tip[:, 2].max() == pytest.approx(38 - 6 + (78 - 8.5) * math.sin(math.radians(15)) + 5, abs=3)
    assert mesh.bounds[0, 2] == pytest.approx(-35)


def test_a_crank_s_grip_stands_upright_at_the_arm_s_end():
    mesh = made("crank_63x26").mesh
    top = mesh.vertices[mesh.vertices[:, 2] > mesh.bounds[1, 2] - 1e-6]
    assert top[:, 0].mean() == pytest.approx(63, abs=0.5)
    assert mesh.bounds[1, 2] == pytest.approx(11 + 50)
