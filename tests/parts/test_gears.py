"""Gears, racks, worms: teeth counted and measured, bores open."""

import math

import numpy as np
import pytest

from tests.parts.turned import cylinder, extents, is_inside, made, radii, tips


@pytest.mark.parametrize(
    ("name", "module", "teeth", "helix"),
    [
        ("spur_gear_m4_z14x24", 4, 14, 0),
        ("webbed_gear_m3_z18x24", 3, 18, 0),
        ("spoked_gear_m4_z16x26", 4, 16, 0),
        ("helical_gear_m4_z14x26", 4, 14, 25),
        ("pinion_shaft_m3_z16x82", 3, 16, 20),
    ],
)
def test_teeth_reach_the_tip_circle_and_are_as_many_as_named(name, module, teeth, helix):
    solid = made(name)
    tip = module * (teeth / math.cos(math.radians(helix)) + 2) / 2
    assert radii(solid).max() == pytest.approx(tip, rel=2e-3)
    assert tips(solid, radii(solid).max(), (-1.0, 0.01), teeth) == teeth


def test_a_tooth_is_half_a_pitch_wide_at_the_pitch_circle():
    solid = made("spur_gear_m5_z12x44")
    angles = np.radians(np.arange(0, 360, 0.5) + 0.1)
    share = np.mean([is_inside(solid, 30 * np.cos(a), 30 * np.sin(a), 20) for a in angles])
    assert share == pytest.approx(0.5, abs=0.02)


def test_a_helical_tooth_turns_by_the_face_width_over_the_lead():
    solid = made("helical_gear_m4_z14x26")  # 25 degrees, right-hand
    points, tip = np.asarray(solid.mesh.vertices), radii(solid).max()
    on_tip = points[(radii(solid) > 0.999 * tip) & (points[:, 1] ** 2 < points[:, 0] ** 2)]
    at = {}
    for z in (0.0, 26.0):
        angles = np.arctan2(on_tip[:, 1], on_tip[:, 0])[np.abs(on_tip[:, 2] - z) < 1e-6]
        at[z] = np.angle(np.exp(1j * 14 * angles).mean()) / 14
    pitch_radius = 4 * 14 / math.cos(math.radians(25)) / 2
    turn = 26 * math.tan(math.radians(25)) / pitch_radius
    assert (at[26.0] - at[0.0] - turn) % (2 * math.pi / 14) == pytest.approx(0, abs=0.01) or (
        at[26.0] - at[0.0] - turn
    ) % (2 * math.pi / 14) == pytest.approx(2 * math.pi / 14, abs=0.01)


def test_bores_of_wheels_are_open_and_shafts_are_not():
    for name in (
        "spur_gear_m4_z14x24",
        "webbed_gear_m3_z18x24",
        "helical_gear_m3_z16x24",
        "bevel_gear_m2_z20x20",
    ):
        solid = made(name)
        low, high = np.asarray(solid.mesh.vertices)[:, 2].min(), np.asarray(solid.mesh.vertices)[:, 2].max()
        assert not any(is_inside(solid, 0, 0, z) for z in np.linspace(low + 0.3, high - 0.3, 5)), name
    assert is_inside(made("pinion_shaft_m3_z16x82"), 0, 0, 13)


def test_a_web_is_thinner_than_the_rim_and_spokes_leave_windows():
    web = made("webbed_gear_m4_z16x40")  # web of 10 in the middle of 40
    assert is_inside(web, 18.6, 0, 20) and not is_inside(web, 18.6, 0, 26)
    spokes = made("spoked_gear_m4_z16x26")  # three spokes
    angles = np.radians(np.arange(0, 360, 2))
    inside = np.array([is_inside(spokes, 18 * np.cos(a), 18 * np.sin(a), 13) for a in angles])
    assert np.count_nonzero(np.diff(np.append(inside, inside[:1]).astype(int)) == 1) == 3


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
