"""Kernel regression of displacements: accuracy, symmetry, and behaviour far from all grasps."""

import numpy as np
import pytest

from mskgrasp.core.geometry import Pose, wrap_angle
from mskgrasp.core.grasp import centre_in_grasp_frame, to_grasp_displacement
from mskgrasp.trials.lowess import Lowess
from tests import synthetic


def attempts(n: int, seed: int) -> tuple[Pose, np.ndarray, np.ndarray]:
    """Poses of a box, successful grasps of it, and their grasp displacements."""
    rng = np.random.default_rng(seed)
    positions, quaternions, grasps, moved = [], [], [], []
    while len(grasps) < n:
        yaw = rng.uniform(-np.pi, np.pi)
        box = synthetic.Box(x=0.5, y=rng.uniform(-0.05, 0.05), yaw=yaw, size=(0.06, 0.02, 0.03))
        offset = rng.uniform(-0.01, 0.01, 2)
        across = wrap_angle(yaw + rng.uniform(-0.3, 0.3) + np.pi * rng.integers(2))
        theta = (across + np.pi / 2) % np.pi - np.pi / 2
        grasp = np.array([box.x + offset[0], box.y + offset[1], 0.015, theta])
        held, shift = synthetic.attempt(box, grasp)
        if held:
            pose = box.T_base_obj
            centre = centre_in_grasp_frame(pose.position, grasp)
            positions.append(pose.position)
            quaternions.append(pose.quat_wxyz)
            grasps.append(grasp)
            moved.append(to_grasp_displacement(shift, centre))
    pose = Pose(position=np.array(positions), quat_wxyz=np.array(quaternions))
    return pose, np.array(grasps), np.array(moved)


def test_displacements_of_similar_grasps_are_predicted():
    known, test = attempts(600, 0), attempts(100, 1)
    mean, variance = Lowess.fit(*known).predict(*test[:2])
    error = np.abs(test[2] - mean)
    at_rest = np.abs(test[2])
    assert np.median(error[:, 1]) < 0.35 * np.median(at_rest[:, 1])
    assert np.median(wrap_angle(error[:, 3])) < 0.35 * np.median(at_rest[:, 3])
    assert (variance >= 0).all() and np.isfinite(variance).all()


def test_half_a_turn_of_the_jaw_changes_no_prediction():
    poses, grasps, moved = attempts(200, 2)
    model = Lowess.fit(poses, grasps, moved)
    mean, variance = model.predict(poses, grasps)
    # Half a turn of the jaw reverses x and y of the grasp frame.
    turned = grasps + np.array([0, 0, 0, np.pi])
    again, same = model.predict(poses, turned)
    np.testing.assert_allclose(again, mean * [-1, -1, 1, 1], atol=1e-12)
    np.testing.assert_allclose(same, variance, atol=1e-12)


def test_far_from_all_grasps_the_prediction_is_finite():
    poses, grasps, moved = attempts(20, 3)
    mean, _ = Lowess.fit(poses, grasps, moved).predict(poses, grasps + np.array([5.0, 0, 0, 0]))
    assert np.isfinite(mean).all()


def test_one_grasp_is_refused():
    poses, grasps, moved = attempts(1, 4)
    with pytest.raises(ValueError, match="at least two"):
        Lowess.fit(poses, grasps, moved)
