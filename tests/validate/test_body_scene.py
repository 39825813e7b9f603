"""Plain bodies in the scene of the labels: made as asked for, placed, pushed, turned and held."""

from __future__ import annotations

import numpy as np
import pytest

from mskgrasp.core.geometry import Pose, quat_about_z, quat_multiply
from mskgrasp.core.settings import Physics
from mskgrasp.parts.solids import shape as h
from mskgrasp.validate.body_scene import ALOFT, BLOCK, GRAVITY, BodyScene, Workshop, turn_about

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
ALONE = (0.5, 0.3, 0.5)
"""In the air, clear of the arm."""


def test_a_body_has_the_mass_the_edges_and_the_centroid_that_were_asked_for(workshop: Workshop):
    block = workshop.block()
    assert block.mass == pytest.approx(0.1) and block.extents == pytest.approx(BLOCK)
    # Of a box: m / 12 times the sum of squares of the other edges.
    squares = np.square(BLOCK)
    np.testing.assert_allclose(np.diag(block.inertia), 0.1 / 12 * (squares.sum() - squares), rtol=1e-5)
    aside = workshop.part("aside", h.block(0, 10, 0, 20, 5, 15), 0.2)
    np.testing.assert_allclose(workshop.centroid(aside), [5, 10, 10], atol=1e-6)
    assert workshop.part("aside", h.block(0, 1, 0, 1, 0, 1), 9.0) is aside  # made once


@pytest.mark.parametrize("angle", [-3.1, -0.4, 0.0, 1.0, 3.1])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_angle_of_a_turn_has_a_sign_whatever_the_start(axis: int, angle: float):
    start = quat_multiply(quat_about_z(np.array(0.7)), np.array([0.6, 0.8, 0.0, 0.0]))
    turn = np.zeros(4)
    turn[0], turn[1 + axis] = np.cos(angle / 2), np.sin(angle / 2)
    before, after = (
        Pose(position=np.zeros(3), quat_wxyz=quat) for quat in (start, quat_multiply(turn, start))
    )
    assert turn_about(before, after, axis) == pytest.approx(angle)
    assert turn_about(after, before, axis) == pytest.approx(-angle)


def test_a_force_accelerates_a_body_and_a_torque_turns_it(scene: BodyScene, workshop: Workshop):
    block = workshop.block()
    scene.place(block, ALONE)
    scene.body.disable_gravity = True
    t = scene.push([0.2, 0.0, -0.1], 0.1)
    moved = scene.pose().position - ALONE
    np.testing.assert_allclose(moved, np.array([0.2, 0.0, -0.1]) / 0.1 * t**2 / 2, atol=3e-4)
    scene.place(block, ALONE)
    scene.body.disable_gravity = True
    before, torque = scene.pose(), 1e-4
    scene.twist([0.0, 0.0, torque], 0.1)
    expected = torque / block.inertia[2, 2] * 0.1**2 / 2
    assert turn_about(before, scene.pose(), 2) == pytest.approx(expected, rel=0.03)
    assert np.linalg.norm(scene.pose().position - before.position) < 1e-6


def test_a_body_on_the_table_stays_and_one_in_the_air_falls(scene: BodyScene, workshop: Workshop):
    x, y = scene.env.region_centre
    scene.place(workshop.block(), (x, y, BLOCK[2] / 2))
    t = scene.step(0.1)
    assert t == pytest.approx(0.1)
    np.testing.assert_allclose(scene.pose().position, [x, y, BLOCK[2] / 2], atol=1e-5)
    scene.place(workshop.block(), ALONE, fresh=False)
    t = scene.step(0.1)
    assert ALONE[2] - scene.pose().position[2] == pytest.approx(GRAVITY * t**2 / 2, rel=0.02)


def test_a_pinched_block_hangs_where_it_was_put_with_its_weight(scene: BodyScene, workshop: Workshop):
    scene.pinch(workshop.block(), along=(0.005, 0.0, 0.0))
    before = scene.pose_in_hand()
    scene.step(0.2)
    after = scene.pose_in_hand()
    assert not scene.body.disable_gravity and scene.pose().position[2] == pytest.approx(ALOFT, abs=5e-4)
    assert np.linalg.norm(after.position - before.position) < 5e-5
    # In the hand's axes: x is the base's, y and z are reversed (the hand points down).
    np.testing.assert_allclose(after.position, [0.005, 0.0, 0.0], atol=5e-4)


def test_a_grasp_of_a_block_in_the_middle_moves_it_nowhere(scene: BodyScene, workshop: Workshop):
    x, y = scene.env.region_centre
    outcome = scene.grasp(workshop.block(), (x, y, BLOCK[2] / 2))
    assert bool(outcome["success"]) and np.abs(outcome["displacement"]).max() < 2e-4
    aside = scene.grasp(workshop.block(), (x, y + 0.2, BLOCK[2] / 2))
    assert not bool(aside["success"]) and np.isnan(aside["displacement"]).all()


def test_a_scene_has_the_settings_under_test(workshop: Workshop):
    other = BodyScene(Physics(rate_hz=500, position_iterations=10), workshop.block())
    try:
        assert other.env.motion.rate_hz == 500 and other.physics.position_iterations == 10
        assert other.step(0.02) == pytest.approx(0.02)
    finally:
        other.close()
