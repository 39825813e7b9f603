"""Shared shapes of fasteners, eyes and grips against formulas."""

import numpy as np
import pytest
import shapely

from mskgrasp.parts.recipes.families import forms


def test_a_torus_has_the_volume_of_pappus():
    assert forms.torus(30, 6).body.volume() == pytest.approx(2 * np.pi**2 * 30 * 36, rel=0.01)


def test_a_hexagonal_ring_is_a_hexagon_without_its_bore():
    ring = forms.hex_ring(24, 6, 0, 10)
    assert ring.body.volume() == pytest.approx((np.sqrt(3) / 2 * 24**2 - np.pi * 36) * 10, rel=2e-3)


def test_an_arm_between_discs_is_as_long_as_its_discs_reach():
    arm = forms.arm(0, 5, (0, 0, 10), (50, 0, 6))
    low, high = np.reshape(arm.body.bounding_box(), (2, 3))
    assert high[0] - low[0] == pytest.approx(10 + 50 + 6) and high[2] - low[2] == pytest.approx(5)
    assert len(arm.hulls) == 1


def test_lobes_stay_between_the_circle_and_their_depth():
    outline = forms.lobes(25, 5, 4)
    radius = np.linalg.norm(outline, axis=1)
    assert radius.max() == pytest.approx(25, abs=0.1) and 25 - 4.5 <= radius.min() <= 25 - 1
    assert shapely.Polygon(outline).is_valid
