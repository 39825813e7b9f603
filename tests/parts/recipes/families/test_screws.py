"""Screws with special heads."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import made


def test_a_countersunk_screw_is_a_cone_of_90_degrees_on_a_shank():
    # Rim 0.64 high; frustum from 15 to 8 mm radius over 7; shank to 80; socket 10 wide, 5.3 deep.
    rim, cone = math.pi * 15**2 * 0.64, math.pi / 3 * 7 * (15**2 + 15 * 8 + 8**2)
    shank, socket = math.pi * 8**2 * (80 - 7.64), math.sqrt(3) / 2 * 100 * 5.3
    mesh = made("countersunk_screw_m16x80").mesh
    assert mesh.volume == pytest.approx(rim + cone + shank - socket, rel=0.01)
    assert mesh.extents[2] == pytest.approx(80)


def test_a_carriage_bolt_has_a_spherical_cap_and_a_square_neck():
    radius, k = 38.8 / 2, 8.95
    cap = math.pi * k / 6 * (3 * radius**2 + k**2)
    neck = (16.7**2 - math.pi * 8**2) * 12.9
    shank = math.pi * 8**2 * 90
    assert made("carriage_bolt_m16x90").mesh.volume == pytest.approx(cap + neck + shank, rel=0.01)


def test_a_shoulder_screw_is_as_long_as_head_shoulder_and_thread():
    mesh = made("shoulder_screw_m12x70").mesh
    assert mesh.extents[2] == pytest.approx(11 + 70 + 18)
    head, socket = math.pi * 12**2 * 11, math.sqrt(3) / 2 * 8**2 * 6.6
    rest = math.pi * (8**2 * 70 + 6**2 * 18)
    assert mesh.volume == pytest.approx(head - socket + rest, rel=0.01)


def test_a_button_head_is_as_wide_and_high_as_the_standard_says():
    mesh = made("button_screw_m12x50").mesh
    assert mesh.extents == pytest.approx([21, 21, 56.6], abs=0.02)


def test_a_flange_bolt_has_its_flange_at_the_bearing_face():
    mesh = made("heavy_flange_bolt_m12x60").mesh
    assert mesh.extents == pytest.approx([26.6, 26.6, 71.8], abs=0.05)
    wide = mesh.vertices[np.hypot(*mesh.vertices[:, :2].T) > 13.2]
    assert wide[:, 2].min() == pytest.approx(-1.8) and wide[:, 2].max() == pytest.approx(0)


def test_a_t_slot_bolt_weighs_like_two_boxes_and_a_rod():
    head, neck = 28 * 28 * 10, 18 * 18 * 10
    shank = math.pi * 8**2 * (80 - 10)
    assert made("t_slot_bolt_m16x80").mesh.volume == pytest.approx(head + neck + shank, rel=0.01)


def test_a_thumb_screw_s_knurls_stand_at_the_head_s_diameter():
    mesh = made("thumb_screw_m10x30").mesh
    radius = np.hypot(*mesh.vertices[:, :2].T)
    assert radius.max() == pytest.approx(18, abs=1e-6)
    assert mesh.extents[2] == pytest.approx(23 + 30)


def test_a_wing_screw_spans_what_the_standard_says_and_is_symmetric():
    mesh = made("wing_screw_m12x40").mesh
    assert mesh.extents[0] == pytest.approx(63.5, abs=0.02)
    assert mesh.extents[2] == pytest.approx(27.25 + 40, abs=0.02)
    assert mesh.center_mass[:2] == pytest.approx([0, 0], abs=1e-3)
