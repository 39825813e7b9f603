"""Devices: weights by hand and by catalogue, fins and blades counted, boxes open."""

import numpy as np
import pytest

from mskgrasp.parts.recipes.families import recipes
from mskgrasp.parts.recipes.recipe import table
from tests.parts.recipes.families.made_shapes import cylinder, extents, is_inside, made


def test_a_heat_sink_weighs_like_its_base_and_fins():
    assert made("heat_sink_20x15x30").mesh.volume == pytest.approx(20 * 3 * 30 + 5 * 1.6 * 12 * 30, rel=1e-6)


def test_heat_sinks_have_as_many_fins_as_the_table_says():
    for row in table("heat_sink.csv"):
        solid = made(f"heat_sink_{row['a_mm']:g}x{row['b_mm']:g}x{row['l_mm']:g}")
        high = 0.8 * row["b_mm"]
        across = [is_inside(solid, 5.01, y, high) for y in np.linspace(-0.5, row["a_mm"] + 0.5, 400)]
        assert int(np.sum(np.diff(np.array(across, int)) > 0)) == row["fins"]


def test_a_stepper_motor_of_size_17_has_the_flange_of_nema_ics_16():
    solid = made("stepper_motor_17x40")
    assert extents(solid) == pytest.approx([42.3, 42.3, 64], abs=0.05)
    for x in (-15.5, 15.5):
        assert not is_inside(solid, x, 15.5, 39) and is_inside(solid, x, 12, 39)
    assert is_inside(solid, 10.9, 0, 41) and not is_inside(solid, 11.1, 0, 41)  # pilot of 22
    mass = solid.mesh.volume * 1e-9 * recipes()["stepper_motor_17x40"].density
    assert mass == pytest.approx(0.28, rel=0.06)


def test_a_gearmotor_has_an_eccentric_shaft():
    solid = made("gearmotor_27x66")  # 5 off the axis, shaft of 6
    assert is_inside(solid, 5, 0, 80) and not is_inside(solid, 0, 0, 80)
    assert extents(solid)[2] == pytest.approx(66 + 18 + 2)


def test_the_plunger_of_a_solenoid_stands_out_of_its_frame():
    solid = made("solenoid_22x25x38")
    assert extents(solid) == pytest.approx([38 + 18, 22, 25], abs=0.05)
    assert is_inside(solid, 45, 0, 13.75) and not is_inside(solid, 45, 0, 20)


def test_relays_have_as_many_blades_as_the_table_says():
    for row in table("relay.csv"):
        solid = made(f"relay_{row['a_mm']:g}x{row['b_mm']:g}x{row['c_mm']:g}")
        half = row["a_mm"] / 2
        along = [is_inside(solid, x, 0.1, -1.0) for x in np.linspace(-half, half, 300)]
        assert int(np.sum(np.diff(np.array(along, int)) > 0)) == row["pins"]


def test_a_terminal_hooks_on_a_rail_of_35_mm():
    solid = made("terminal_block_60x42x10p2")
    assert not is_inside(solid, 17.6, 0, 4) and is_inside(solid, 18.5, 0, 4)
    assert is_inside(solid, 17, 0, 0.8) and not is_inside(solid, 14, 0, 0.8)


def test_a_clip_is_as_wide_inside_as_the_rail():
    solid = made("rail_clip_44x16")
    middle = 22
    for side in (-1, 1):
        assert not is_inside(solid, middle + side * 17.4, 0, -2) and is_inside(
            solid, middle + side * 18.2, 0, -2
        )


def test_a_connector_is_open_in_front_and_closed_behind():
    solid = made("connector_shell_30x22x72")
    assert not is_inside(solid, 0, 0, 70) and not is_inside(solid, 12.5, 8.5, 40)
    assert is_inside(solid, 0, 0, 30) and is_inside(solid, 14, 0, 70)


def test_an_enclosure_is_open_above_with_a_boss_in_every_corner():
    solid = made("enclosure_85x56x40")  # walls 2.5, bosses 6
    assert not is_inside(solid, 0, 0, 20) and is_inside(solid, 0, 0, 1) and is_inside(solid, 0, 26.8, 20)
    for x in (-36, 36):
        for y in (-21.5, 21.5):
            assert is_inside(solid, x, y, 10)
    assert not is_inside(solid, -41.3, 0, 22)


def test_a_transformer_weighs_like_core_winding_and_feet():
    core, winding, feet = 36 * 16 * 30, 0.62 * 36 * (28 - 16) * 0.6 * 30, 2 * 8 * 0.6 * 16 * 2.5
    expected = core + winding + feet - 2 * cylinder(4, 2.5)
    assert made("transformer_36x16x30").mesh.volume == pytest.approx(expected, rel=0.002)
