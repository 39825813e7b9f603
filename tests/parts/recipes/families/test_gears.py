"""Gears: teeth counted and measured, bores open."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import is_inside, made, radii, tips


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
