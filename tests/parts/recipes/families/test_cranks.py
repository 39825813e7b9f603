"""Eccentrics, cranks and cams: throws and lifts."""

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import is_inside, made


def test_an_eccentric_lies_off_the_axis():
    solid = made("eccentric_shaft_44x6x50")
    points = np.asarray(solid.mesh.vertices)
    assert points[:, 0].max() == pytest.approx(22 + 6, abs=0.05)
    assert points[:, 0].min() == pytest.approx(-22 + 6, abs=0.05)


def test_a_crank_pin_lies_a_throw_from_the_journals():
    solid = made("crank_shaft_30x140")
    assert is_inside(solid, 30, 0, 70) and not is_inside(solid, 0, 0, 70)
    assert is_inside(solid, 0, 0, 10) and not is_inside(solid, 30, 0, 10)


def test_a_cam_rises_by_its_lift():
    solid = made("disc_cam_48x20x44")
    points = np.asarray(solid.mesh.vertices)
    assert points[:, 0].min() == pytest.approx(-24, abs=0.05)
    assert points[:, 0].max() == pytest.approx(24 + 20, abs=0.05)
