"""Triangles of polygons cover them once."""

import numpy as np
import pytest

from mskgrasp.parts.importing.formats.polygons import triangulated


def areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    return np.cross(b - a, c - a) / 2


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_concave_polygon_in_any_plane_is_covered_once_and_wound_as_it_is(axis):
    outline = np.array([(0, 0), (40, 0), (40, 40), (22, 40), (20, 5), (18, 40), (0, 40)], dtype=float)
    points = np.roll(np.column_stack([outline, np.full(7, 3.0)]), axis, axis=1)
    normal = np.roll([0.0, 0, 1], axis)
    for corners, sign in ((np.arange(7), 1), (np.arange(7)[::-1], -1)):
        found = areas(points, triangulated(points, corners)) @ normal
        assert (sign * found >= 0).all()
        assert sign * found.sum() == pytest.approx(1600 - 4 * 35 / 2)


def test_a_convex_polygon_becomes_a_fan():
    points = np.array([(0, 0, 0), (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0)], dtype=float)
    assert triangulated(points, np.arange(5)).tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4]]


def test_references_to_missing_points_are_left_to_the_checks_that_follow():
    points = np.zeros((3, 3))
    assert triangulated(points, np.array([0, 1, 2, 9])).max() == 9
