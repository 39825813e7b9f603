"""Bearings, bushings, collars and spacers weigh what their rings do, and are open."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import cylinder, extents, family, is_inside, made, radii

OPEN = (
    "bearing",
    "bushing",
    "flanged_bushing",
    "shaft_collar",
    "needle_bearing",
    "thrust_bearing",
    "spherical_bearing",
    "linear_bearing",
    "flanged_linear_bearing",
    "spacer",
    "stepped_spacer",
    "plastic_sleeve",
    "trapezoidal_nut",
)


@pytest.mark.parametrize("name", OPEN)
def test_every_ring_is_open_along_its_axis(name):
    names = family(name)
    assert len(names) >= 5
    for part in names[::3]:
        solid = made(part)
        assert radii(solid).min() > 3, part
        assert not is_inside(solid, 0, 0, float(np.asarray(solid.mesh.vertices)[:, 2].mean())), part


@pytest.mark.parametrize(
    ("name", "bore", "outer", "width"),
    [
        ("bearing_6206", 30, 62, 16),
        ("bearing_6305", 25, 62, 17),
        ("bearing_61907", 35, 55, 10),
        ("needle_bearing_35x55x36", 35, 55, 36),
        ("thrust_bearing_51207", 35, 62, 18),
        ("spherical_bearing_ge35", 35, 55, 25),
        ("linear_bearing_25x40", 25, 40, 58),
        ("shaft_collar_40", 40, 63, 18),
    ],
)
def test_boundary_dimensions_are_those_of_the_catalogues(name, bore, outer, width):
    solid = made(name)
    assert extents(solid) == pytest.approx([outer, outer, width], abs=0.05)
    assert radii(solid).min() == pytest.approx(bore / 2, abs=0.02)


def test_a_flanged_bushing_weighs_like_its_tube_and_flange():
    solid = made("flanged_bushing_50x60x60")
    volume = cylinder(60, 60) - cylinder(50, 60) + cylinder(68, 5) - cylinder(60, 5)
    assert solid.mesh.volume == pytest.approx(volume, rel=0.002)


def test_a_ball_looks_out_of_a_spherical_bearing_on_both_sides():
    solid = made("spherical_bearing_ge40")  # ball of 53, ring 22 wide, 28 wide in all
    assert is_inside(solid, math.sqrt(26.5**2 - 13**2) - 0.3, 0, 13)
    assert not is_inside(solid, math.sqrt(26.5**2 - 13**2) + 0.3, 0, -13)


def test_flanges_have_their_bolt_holes():
    solid = made("flanged_linear_bearing_25x112")  # flange of 62 x 8, tube of 40: holes on a circle of 51
    for angle in np.radians([0, 90, 180, 270]):
        assert not is_inside(solid, 25.5 * np.cos(angle), 25.5 * np.sin(angle), 4)
    assert is_inside(solid, 18.03, 18.03, 4)


def test_no_ring_is_too_wide_for_the_gripper():
    for name in OPEN:
        for part in family(name)[-3:]:
            assert sorted(extents(made(part)))[1] <= 78.01, part
