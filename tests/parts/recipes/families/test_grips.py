"""Knobs and grips."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import made


def test_a_ball_knob_is_a_ball_less_a_cap_and_a_bore():
    radius, flat = 20.0, 11.0
    height = radius - math.sqrt(radius**2 - flat**2)
    cap = math.pi * height**2 / 3 * (3 * radius - height)
    bore = math.pi / 4 * 8.5**2 * 18
    mesh = made("ball_knob_40").mesh
    assert mesh.volume == pytest.approx(4 / 3 * math.pi * radius**3 - cap - bore, rel=0.01)
    assert mesh.extents[:2] == pytest.approx([40, 40], abs=0.05)


@pytest.mark.parametrize(
    ("name", "lobes", "diameter"),
    [
        ("star_knob_50", 7, 50),
        ("palm_knob_63", 4, 63),
        ("tri_knob_50", 3, 50),
        ("star_screw_40xm8x50", 6, 40),
    ],
)
def test_lobed_knobs_have_their_number_of_lobes(name: str, lobes: int, diameter: float):
    mesh = made(name).mesh
    radius = np.hypot(*mesh.vertices[:, :2].T)
    assert radius.max() == pytest.approx(diameter / 2, abs=0.01)
    angles = np.sort(np.arctan2(*mesh.vertices[radius > 0.995 * radius.max(), 1::-1].T))
    gaps = np.diff(angles, append=angles[0] + 2 * np.pi)
    assert np.count_nonzero(gaps > np.pi / lobes / 2) == lobes


def test_a_t_grip_is_as_wide_and_high_as_it_says():
    mesh = made("t_grip_90x50").mesh
    assert mesh.extents[0] == pytest.approx(90)
    assert mesh.bounds[:, 2] == pytest.approx([-30, 50], abs=0.02)
    assert mesh.center_mass[:2] == pytest.approx([0, 0], abs=1e-3)


def test_a_knurled_knob_weighs_like_its_cylinders():
    expected = math.pi * (20**2 * 22 + 15.2**2 * 8 + 5**2 * 60)
    assert made("knurled_knob_40x30").mesh.volume == pytest.approx(expected, rel=0.06)  # knurls and chamfers


def test_a_tommy_screw_is_as_wide_as_its_bar_with_both_balls():
    mesh = made("tommy_screw_m12x60").mesh
    assert mesh.extents[0] == pytest.approx(85 + 14, abs=0.01)
    assert mesh.extents[2] == pytest.approx(1.5 * 20 + 60)


@pytest.mark.parametrize("name", ["mushroom_knob_50x40", "ball_screw_knob_32xm10x90", "tri_knob_60"])
def test_knobs_balance_about_their_axis(name: str):
    assert made(name).mesh.center_mass[:2] == pytest.approx([0, 0], abs=0.01)


def test_a_wing_grip_spans_what_it_says_and_is_flat():
    mesh = made("wing_grip_70xm10").mesh
    assert mesh.extents[0] == pytest.approx(70, abs=0.05)
    far = mesh.vertices[np.abs(mesh.vertices[:, 0]) > 12]
    assert np.ptp(far[:, 1]) == pytest.approx(8)
