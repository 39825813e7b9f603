"""Outlines, prisms and rings against formulas."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from mskgrasp.parts.solids import solid as s


def test_a_balanced_polygon_is_as_far_outside_its_circle_as_inside():
    corners = s.balanced_polygon(20.0, 12)
    outside = np.linalg.norm(corners, axis=1).max() - 20
    inside = 20 - np.linalg.norm((corners + np.roll(corners, 1, axis=0)) / 2, axis=1).min()
    assert outside == pytest.approx(inside)


def test_a_ring_is_cut_into_disjoint_pieces_with_the_volume_of_the_formula():
    pieces = s.ring(20.0, 8.0, 0.0, 5.0)
    volume = sum(ConvexHull(points).volume for points in pieces)
    assert volume == pytest.approx(np.pi * (20**2 - 8**2) * 5, rel=0.02)
    assert max(map(len, pieces)) <= s.MAX_HULL_VERTICES


def test_a_cut_keeps_what_is_behind_the_plane():
    [half] = s.cut([s.box(0, 10, 0, 10, 0, 10)], [np.array([1.0, 0, 0])], [4.0])
    assert half[:, 0].max() == pytest.approx(4) and half[:, 0].min() == pytest.approx(0)


def test_few_corners_of_a_ball_keep_its_extents():
    z = np.linspace(-1, 1, 400)
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(400)
    ball = np.column_stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z])
    few = s.few_corners(ball)
    assert len(few) == s.MAX_HULL_VERTICES
    assert np.allclose(np.ptp(few, axis=0), np.ptp(ball, axis=0))


def test_a_drilled_hole_follows_its_axis():
    body = s.extrude(s.rectangle(-10, 10, -10, 10), 0, 20)
    for axis, start in (("x", (-11, 0, 10)), ("y", (0, -11, 10)), ("z", (0, 0, -1))):
        left = (body - s.drill(3.0, start, axis, 22)).volume()
        assert left == pytest.approx(8000 - np.pi * 9 * 20, rel=1e-3)
