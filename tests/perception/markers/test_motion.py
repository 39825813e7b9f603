from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mskgrasp.core.errors import MarkersNotFound
from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.grasp import object_displacement
from mskgrasp.perception.markers import Markers, check_between_pads, planar_displacement
from tests.perception.markers.drawn import (
    AFTER,
    BEFORE,
    GRASP,
    LARGE,
    STEEL,
    at,
    draw,
    find,
    spot,
)


@pytest.mark.parametrize("turn", [0.12, -0.5, 1.8, 3.0])
def test_the_displacement_is_that_of_the_parts_origin_in_the_grasp_frame(before: Markers, turn: float):
    """Against the definition: poses of the part in the hand before and after."""
    pose = at(0.447, 0.004, 0.5 + turn)
    T_tcp_base = GRASP.T_base_tcp.inverse()
    true, _ = object_displacement(T_tcp_base @ BEFORE, T_tcp_base @ pose)
    measured = planar_displacement(before, find(draw(pose)), GRASP, BEFORE.position)
    assert np.abs(measured[:2] - true[:2]).max() < 0.1e-3
    assert abs(wrap_angle(measured[2] - true[3])) < np.radians(0.15)


def test_a_turn_about_the_parts_origin_does_not_move_it(before: Markers):
    after = find(draw(at(0.45, -0.01, 0.8)))
    dx, dy, dtheta = planar_displacement(before, after, GRASP, BEFORE.position)
    assert np.hypot(dx, dy) < 0.1e-3 and dtheta == pytest.approx(0.3, abs=np.radians(0.15))


def test_a_wrong_centre_costs_what_the_turn_makes_of_it(before: Markers):
    after = find(draw(AFTER))
    right = planar_displacement(before, after, GRASP, BEFORE.position)
    wrong = planar_displacement(before, after, GRASP, BEFORE.position + [0.002, 0, 0])
    cost = float(np.linalg.norm(wrong - right))
    assert cost == pytest.approx(2 * np.sin(0.12 / 2) * 0.002, rel=0.02) and wrong[2] == right[2]


def turned_about_the_tcp(centre: np.ndarray, angle: float) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin], [sin, cos]]) @ centre - centre


SWUNG = turned_about_the_tcp(np.array([0.06, 0.01]), 0.4)


@pytest.mark.parametrize(
    ("displacement", "width", "possible"),
    [
        ((0.004, 0.017, 0.0), 0.046, True),  # each pad closed by 17 mm
        ((0.004, -0.022, 0.0), 0.046, False),
        ((0.0016, 0.052, -0.01), 0.046, False),  # drawn along by the rising hand
        ((SWUNG[0], SWUNG[1], 0.4), 0.07, True),  # the far end swings by 24 mm
        ((SWUNG[0], SWUNG[1] + 0.009, 0.4), 0.07, False),
    ],
)
def test_what_no_jaw_can_have_moved_is_a_mismatch(displacement, width, possible):
    centre = np.array([0.06, 0.01, 0.0])
    if possible:
        check_between_pads(np.array(displacement), centre, width)
        return
    with pytest.raises(MarkersNotFound, match="dragged along"):
        check_between_pads(np.array(displacement), centre, width)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(points_base=[[0, 0, 0], [0.0015, 0, 0]]), "mismatch: the squares were .* mm apart"),
        (
            dict(points_base=[[0, 0, 0.005], [0, 0, 0]]),
            r"mismatch: the squares lie \+5.0 and \+0.0 mm higher",
        ),
        (dict(points_base=[[0, 0, np.nan], [0, 0, 0]]), "mismatch"),
        (dict(sides=[[0, 0], [0, -0.001]]), "mismatch: a side of the smaller square has changed by 1.0 mm"),
    ],
)
def test_squares_that_are_not_those_of_before_are_a_mismatch(before: Markers, change: dict, message: str):
    values = {name: getattr(before, name) + np.array(by) for name, by in change.items()}
    along = np.diff(before.points_base[:, :2], axis=0)
    assert abs(along[0, 0]) > 0.04  # so that a shift along x changes the distance
    with pytest.raises(MarkersNotFound, match=message):
        planar_displacement(before, dataclasses.replace(before, **values), GRASP, BEFORE.position)


def test_a_square_that_is_covered_a_little_after_the_grasp_is_a_mismatch(before: Markers):
    """Too little to be no square of its size, enough to move its centre."""
    edge = LARGE[1] + 0.006
    after = find(draw(BEFORE, extra=spot(LARGE[0], edge, 0.02, 0.0024, STEEL)))
    with pytest.raises(MarkersNotFound, match="mismatch: a side of the larger square"):
        planar_displacement(before, after, GRASP, BEFORE.position)
