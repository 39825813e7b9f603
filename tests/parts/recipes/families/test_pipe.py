"""Fittings with legs: open from end to end, walls as thick as they should be, weights by hand."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import cylinder, family, is_inside, made


def tee(diameter: float, run: float, branch: float) -> float:
    """Volume of two crossing cylinders, the branch from the run's axis outward."""
    return cylinder(diameter, 2 * run + branch) - diameter**3 / 3  # half of what two cylinders share


def test_a_tee_weighs_like_crossing_pipes_and_three_beads():
    solid = made("pipe_tee_26x48x30")
    expected = tee(26, 48, 30) - tee(18, 48, 30) + 3 * (cylinder(31, 8) - cylinder(26, 8))
    assert solid.mesh.volume == pytest.approx(expected, rel=0.003)


@pytest.mark.slow
def test_tees_are_open_at_three_ends():
    for name in (*family("pipe_tee"), *family("hose_tee"), *family("nut_tee")):
        solid = made(name)
        x, _, z = solid.mesh.bounds[1]
        assert not any(is_inside(solid, share * x, 0.01, 0) for share in np.linspace(-0.98, 0.98, 9)), name
        assert not any(is_inside(solid, 0, 0.01, share * z) for share in np.linspace(0, 0.98, 5)), name


def test_an_elbow_is_open_along_both_legs_and_its_wall_is_whole():
    solid = made("pipe_elbow_90_27x34")  # bore 18
    for at in (0, 15, 33):
        assert not is_inside(solid, at, 0.01, 0) and not is_inside(solid, 0, 0.01, at)
    assert not is_inside(solid, 20, 0, 8.9) and is_inside(solid, 20, 0, 9.2)
    assert is_inside(solid, -8, 0, -8) and not is_inside(solid, -10, 0, -10)  # the corner is round


def test_the_legs_of_a_45_degree_elbow_bend_by_45_degrees():
    solid = made("pipe_elbow_45_27x46")
    along = np.array([math.cos(math.radians(135)), math.sin(math.radians(135))])
    for at in (10, 30, 45):
        x, z = at * along
        assert not is_inside(solid, x, 0.01, z)
        assert is_inside(solid, x, 11.5, z)
    assert not is_inside(solid, 45, 0.01, 0) and is_inside(solid, 45, 11.5, 0)


def test_a_90_degree_elbow_weighs_like_mitred_pipes():
    solid = made("pipe_elbow_90_33x82")
    half_share = 82 - (2 / 3) * 33 / math.pi  # what a mitre takes of a leg: the mean of |x| over half a disc
    legs = 2 * (cylinder(33, 82) - cylinder(24, 82)) + 2 * (cylinder(38, 9) - cylinder(33, 9))
    assert half_share < 82
    assert solid.mesh.volume == pytest.approx(legs, rel=0.06)


def test_barbs_stand_out_of_a_hose_tail():
    points = np.asarray(made("hose_tee_16x48").mesh.vertices)
    tail = points[points[:, 2] > 30]
    radius = np.hypot(tail[:, 0], tail[:, 1])
    assert radius.max() == pytest.approx(8 * 1.08, abs=0.02)
    assert len(np.unique(np.round(tail[radius > 8.6, 2], 3))) in (2, 3, 4)


def test_a_nut_has_six_flats_at_its_width():
    points = np.asarray(made("nut_tee_18x54").mesh.vertices)
    nut = points[(points[:, 2] > 35) & (np.hypot(points[:, 0], points[:, 1]) > 10)]
    assert np.ptp(nut[:, 1]) == pytest.approx(27, abs=0.01)
    assert np.hypot(nut[:, 0], nut[:, 1]).max() == pytest.approx(27 / math.sqrt(3), abs=0.01)
