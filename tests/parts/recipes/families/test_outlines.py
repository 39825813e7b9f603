"""Shared outlines and bars against formulas."""

import numpy as np
import pytest
import shapely
from scipy.spatial import ConvexHull

from mskgrasp.parts.recipes.families import outlines


def area(outline: np.ndarray) -> float:
    return shapely.Polygon(outline).area


def test_rounded_corners_lose_what_a_circle_leaves_of_its_square():
    found = area(outlines.rounded(0, 40, 0, 30, 5))
    assert found == pytest.approx(40 * 30 - (4 - np.pi) * 25, rel=1e-3)


def test_a_slot_is_a_rectangle_with_two_half_circles():
    assert area(outlines.slot(0, 20, 3, 4)) == pytest.approx(20 * 8 + np.pi * 16, rel=1e-3)


def test_an_arch_is_a_rectangle_with_a_half_circle():
    assert area(outlines.arch(10, 0, 15)) == pytest.approx(20 * 15 + np.pi * 50, rel=1e-3)


def test_a_mirrored_outline_is_twice_its_half():
    half = [(0, 0), (10, 0), (4, 8), (0, 8)]
    assert area(outlines.mirrored(half)) == pytest.approx(2 * area(np.array(half)))


@pytest.mark.parametrize("along", [outlines.along_x, outlines.along_y])
def test_a_bar_has_its_section_across_its_axis(along):
    bar = along([(0, 0), (8, 0), (0, 6)], -5, 20)
    assert bar.body.volume() == pytest.approx(24 * 25)
    low, high = np.reshape(bar.body.bounding_box(), (2, 3))
    first = 0 if along is outlines.along_x else 1
    assert low[first] == pytest.approx(-5) and high[first] == pytest.approx(20)
    assert low[2] == pytest.approx(0) and high[2] == pytest.approx(6)


def test_wedges_of_a_tube_add_up_to_it():
    pieces = outlines.wedges(10, 20, 0, 5, 12)
    volume = sum(ConvexHull(points).volume for points in pieces)
    assert volume == pytest.approx(np.pi * (400 - 100) * 5, rel=0.01)
