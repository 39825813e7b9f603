"""Parts with an eye."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import made


@pytest.mark.parametrize(
    ("name", "grams"), [("eyebolt_m12", 180), ("eyebolt_m16", 280), ("eyebolt_m20", 450)]
)
def test_eyebolts_weigh_about_what_din_580_says(name: str, grams: float):
    assert 7.85e-3 * made(name).mesh.volume == pytest.approx(grams, rel=0.13)


def test_an_eyebolt_of_m16_has_the_standard_s_ring():
    mesh = made("eyebolt_m16").mesh
    assert mesh.extents[0] == pytest.approx(63, abs=0.05)
    assert mesh.bounds[1, 2] == pytest.approx(62, abs=0.05) and mesh.bounds[0, 2] == pytest.approx(-27)
    # The ring's inner diameter along x, at the height of its centre.
    level = mesh.vertices[np.abs(mesh.vertices[:, 2] - (62 - 31.5)) < 0.5]
    assert np.abs(level[:, 0]).min() == pytest.approx(17.5, abs=0.1)
    assert mesh.euler_number == 0


def test_an_eye_nut_is_threaded_from_below():
    mesh = made("eye_nut_m12").mesh
    face = mesh.vertices[mesh.vertices[:, 2] < 1e-6]
    radius = np.hypot(*face[:, :2].T)
    assert radius.min() == pytest.approx(10.106 / 2, abs=0.01) and radius.max() == pytest.approx(15, abs=0.01)


def test_a_swing_bolt_has_its_eye_about_the_origin():
    mesh = made("swing_bolt_m12x90").mesh
    assert mesh.euler_number == 0
    assert mesh.bounds[1, 2] == pytest.approx(90) and mesh.bounds[0, 2] == pytest.approx(-12.5, abs=0.01)
    assert mesh.extents[1] == pytest.approx(14)
    assert np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 2]).min() == pytest.approx(6, abs=0.01)


def test_a_ring_bolt_weighs_like_a_torus_a_nut_and_a_shank():
    torus = 2 * math.pi**2 * 20 * 5**2
    shank = math.pi * 5**2 * 65
    nut = (math.sqrt(3) / 2 * 16**2 - math.pi * 25) * 8
    assert made("ring_bolt_m10x65").mesh.volume == pytest.approx(torus + shank + nut, rel=0.03)


@pytest.mark.parametrize("name", ["shackle_8x18", "ring_bolt_m12x75"])
def test_shackles_and_ring_bolts_enclose_one_opening(name: str):
    assert made(name).mesh.euler_number == 0


def test_a_turnbuckle_has_two_threads_and_a_window():
    mesh = made("turnbuckle_m10x125").mesh
    assert mesh.euler_number == 2 - 2 * 3
    assert mesh.extents[2] == pytest.approx(125)
    assert np.hypot(*mesh.vertices[:, :2].T).min() == pytest.approx(8.376 / 2, abs=0.01)


def test_a_pipe_turnbuckle_weighs_like_a_tube_with_two_nuts():
    tube = math.pi / 4 * (20**2 - 14**2) * (110 - 32)
    nuts = 2 * (math.sqrt(3) / 2 * 22**2 - math.pi / 4 * 8.376**2) * 16
    holes = 2 * math.pi / 4 * 5**2 * 3
    assert made("pipe_turnbuckle_m10x110").mesh.volume == pytest.approx(tube + nuts - holes, rel=0.01)
