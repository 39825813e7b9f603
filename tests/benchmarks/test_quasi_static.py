"""Quasi-static pushing against what can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from tests.benchmarks.quasi_static import Push, corners, rectangle


def _even(points: np.ndarray, *, mu: float = 0.5) -> Push:
    return Push(support=points, weight=np.full(len(points), 1 / len(points)), mu=mu, half_thickness=0.01)


@pytest.mark.parametrize("points", [rectangle(0.08, 0.02), corners(0.08, 0.02)])
def test_a_push_through_the_centre_does_not_turn(points):
    moved = _even(points).run(np.zeros(3), 0.0, 0.005)
    assert moved == pytest.approx([0, -0.005, 0], abs=1e-6)


def test_a_ring_pushed_a_little_off_its_centre_turns_as_the_expansion_says():
    # Dissipation a unit of way, of a ring of radius r pushed at (b, h), to the second order in the turn w:
    # 1 - w b + w^2 (r^2 / 4 + h^2 / 2); it is least at w = b / (r^2 / 2 + h^2). The edge moves in -y.
    radius, off, height = 0.03, 1e-4, 0.01
    angles = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    ring = _even(radius * np.stack([np.cos(angles), np.sin(angles)], axis=1))
    way = 1e-5
    turn = ring.run(np.zeros(3), off, way)[2] / way
    assert turn == pytest.approx(-off / (radius**2 / 2 + height**2), rel=0.01)


def test_without_friction_at_the_contact_two_points_turn_about_the_one_that_rests():
    # The push is normal to the bar between its two points. With equal loads both can slide only if it is in
    # the middle; else the bar turns about the farther point.
    bar = _even(np.array([[0.04, 0.0], [-0.04, 0.0]]), mu=0.0)
    way = 1e-5
    _, y, turn = bar.run(np.zeros(3), 0.01, way)
    assert turn == pytest.approx(-way / 0.05, rel=0.01)
    assert y == pytest.approx(0.04 * turn, rel=0.01)


def test_a_contact_at_the_edge_of_its_friction_cone_slides():
    start, way = np.array([0.0, 0.0, -0.4]), 1e-4
    sticking, sliding = (_even(rectangle(0.08, 0.02), mu=mu).run(start, 0.0, way) for mu in (0.6, 0.1))
    # tan 0.4 = 0.42: the first moves with the edge, the second is pushed aside along its face.
    assert abs(sticking[0]) < 0.1 * abs(sliding[0])
