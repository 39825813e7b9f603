"""Racks, bevel gears and worms: pitches and leads."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import cylinder, extents, is_inside, made, radii, tips


def test_a_rack_has_pi_modules_a_tooth_and_weighs_like_half_filled_teeth():
    solid = made("rack_m4x7x36")
    assert extents(solid) == pytest.approx([7 * math.pi * 4, 30, 36 + 4], abs=0.01)
    # Over the root line lie 2.25 modules of tooth; the pitch line is filled by half.
    assert is_inside(solid, 2 * math.pi, 0, 36) and not is_inside(solid, 4 * math.pi, 0, 33)
    mean = (math.pi * 2 + 0.125 * 4 * 2 * math.tan(math.radians(20))) / (math.pi * 4)
    area = 7 * math.pi * 4 * (36 - 5 + 9 * mean)
    assert solid.mesh.volume == pytest.approx(area * 30, rel=0.01)


def test_a_round_rack_is_a_bar_with_gaps_on_one_side():
    solid = made("round_rack_m4x8x120")
    assert extents(solid)[:2] == pytest.approx([42, 42], abs=0.1)
    inside = np.array([is_inside(solid, 0.8 * 21 - 4, 0, z) for z in np.arange(5, 116, 0.5)])
    assert np.count_nonzero(np.diff(inside.astype(int)) == -1) == 9  # eight teeth between two plain ends


def test_bevel_teeth_run_to_the_apex_of_the_pitch_cone():
    solid = made("bevel_gear_m4_z14x14")
    # A mitre gear: apex 28 over the pitch circle, tip cone at 45 degrees and the addendum's angle.
    distance = 28 * math.sqrt(2)
    tip = math.pi / 4 + math.atan(4 / distance)
    points = np.asarray(solid.mesh.vertices)
    far = points[np.argmax(radii(solid))]
    assert math.hypot(far[0], far[1]) / (28 - far[2]) == pytest.approx(math.tan(tip), rel=0.01)
    assert math.hypot(far[0], far[1]) == pytest.approx(28 + 4 / math.sqrt(2), rel=0.01)
    assert tips(solid, radii(solid).max(), (-50, 50), 14) == 14


def test_the_thread_of_a_worm_rises_by_pi_modules_a_turn():
    solid = made("worm_m4x110")
    inside = np.array([is_inside(solid, 0, 18.5, z) for z in np.arange(0, 50, 0.25)])
    starts = np.arange(0, 50, 0.25)[1:][np.diff(inside.astype(int)) == 1]
    assert np.diff(starts) == pytest.approx(math.pi * 4, abs=0.3)
    assert extents(solid)[2] == pytest.approx(110, abs=0.01)
    assert solid.mesh.volume > cylinder(20, 60) + cylinder(2 * (18 - 4.8), 50)
