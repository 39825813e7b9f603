"""Where the part is expected in the hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mskgrasp.core.geometry import Pose, quat_multiply, quat_rotate
from mskgrasp.core.grasp import Grasp, object_displacement, swing_in_hand
from mskgrasp.view.ghosts import expected_motion, likely_motions, motion_of
from tests.planning.hand_made import FRAME, planner

GRASP = Grasp.from_vector(np.array([0.5, 0.02, 0.03, 0.7]))
POINT = np.array([0.51, 0.04, 0.02])
PLAN = planner().plan(FRAME, np.random.default_rng(0))


def measured(motion: Pose, point_base: np.ndarray, grasp: Grasp) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and swing of a body whose origin is at a point, by the definition."""
    before = Pose(position=point_base, quat_wxyz=np.array([1.0, 0.0, 0.0, 0.0]))
    tcp = grasp.T_base_tcp.inverse()
    held = tcp @ before, tcp @ motion @ before
    return np.asarray(object_displacement(*held)[0]), np.asarray(swing_in_hand(*held))


@pytest.mark.parametrize("swing", [None, np.array([np.nan, np.nan]), np.array([0.2, -0.1])])
def test_the_moved_point_has_the_displacement_and_the_part_the_swing(swing: np.ndarray | None):
    displacement = np.array([0.003, -0.002, 0.001, 0.25])
    motion = motion_of(GRASP.T_base_grasp, displacement, POINT, swing)
    found, swung = measured(motion, POINT, GRASP)
    np.testing.assert_allclose(found, displacement, atol=1e-12)
    np.testing.assert_allclose(
        swung, [0.2, -0.1] if swing is not None and swing[0] > 0 else [0, 0], atol=1e-9
    )


def test_a_plan_expects_the_seen_centre_where_it_says():
    found, _ = measured(expected_motion(PLAN), PLAN.view.centre_base, PLAN.grasp)
    np.testing.assert_allclose(found, PLAN.displacement, atol=1e-12)


def test_the_likely_motions_are_those_of_two_standard_deviations():
    motions = likely_motions(PLAN)
    assert len(motions) == 8
    off = np.array([measured(one, PLAN.view.centre_base, PLAN.grasp)[0] for one in motions])
    off -= PLAN.displacement
    np.testing.assert_allclose(off.sum(axis=0), 0, atol=1e-10)
    # Both ends of every axis: twice the covariance, times two squared.
    np.testing.assert_allclose(off.T @ off, 8 * PLAN.displacement_cov, rtol=1e-6, atol=1e-12)


def test_without_predicted_variances_there_are_none():
    assert likely_motions(replace(PLAN, grasp_displacement_cov=np.full((4, 4), np.nan))) == []


def test_a_part_that_does_not_move_stays():
    motion = motion_of(GRASP.T_base_grasp, np.zeros(4), POINT)
    np.testing.assert_allclose(motion.apply(POINT + 0.03), POINT + 0.03, atol=1e-12)
    turned = quat_rotate(quat_multiply(motion.quat_wxyz, motion.quat_wxyz), np.array([1.0, 0, 0]))
    np.testing.assert_allclose(turned, [1, 0, 0], atol=1e-12)
