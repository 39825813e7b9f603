"""Execution noise: distributed as documented, drawn in a fixed order, and checked."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from mskgrasp.core.geometry import Pose
from mskgrasp.core.settings import ExecutionNoise

EVERYTHING = ExecutionNoise(
    arm_position_std=1e-3, arm_angle_std=0.02, finger_force=(10, 30), friction_pad_part=(0.3, 0.7),
    camera_position_std=2e-3, camera_angle_std=5e-3,
)  # fmt: skip


def draws(noise: ExecutionNoise, n: int = 4000) -> list:
    rng = np.random.RandomState(0)
    return [noise.draw(rng) for _ in range(n)]


def test_errors_are_distributed_as_documented():
    drawn = draws(EVERYTHING)
    # Five standard errors of a standard deviation and of a mean, n = 4000.
    for values, std in (
        (np.array([one.grasp[:3] for one in drawn]), 1e-3),
        (np.array([one.grasp[3:] for one in drawn]), 0.02),
        (np.array([one.camera_shift for one in drawn]), 2e-3),
        (np.array([one.camera_turn for one in drawn]), 5e-3),
    ):
        assert np.allclose(values.std(axis=0), std, rtol=5 / np.sqrt(2 * 4000))
        assert np.abs(values.mean(axis=0)).max() < 5 * std / np.sqrt(4000)
    for values, (low, high) in (
        (np.array([one.finger_force for one in drawn]), (10, 30)),
        (np.array([one.friction_pad_part for one in drawn]), (0.3, 0.7)),
    ):
        assert low <= values.min() < low + 0.01 * (high - low)
        assert high - 0.01 * (high - low) < values.max() <= high
        assert values.mean() == pytest.approx((low + high) / 2, abs=5 * (high - low) / np.sqrt(12 * 4000))


def test_switching_one_error_on_leaves_the_others_as_they_were():
    every = draws(EVERYTHING, 5)[-1]
    one = draws(EVERYTHING.model_copy(update=dict(arm_position_std=0.0, finger_force=None)), 5)[-1]
    assert np.array_equal(one.grasp[3:], every.grasp[3:]) and not one.grasp[:3].any()
    assert one.friction_pad_part == every.friction_pad_part
    assert np.array_equal(one.camera_turn, every.camera_turn)


def test_the_camera_turns_in_its_own_frame_and_moves_in_the_base():
    error = draws(EVERYTHING, 1)[0]
    matrix = Rotation.from_euler("xyz", [3.0, 0.2, -0.4]).as_matrix()
    calibrated = Pose.from_matrix(np.block([[matrix, np.array([[0.5], [0.1], [0.8]])], [0, 0, 0, 1]]))
    true = error.true_camera(calibrated).as_matrix()
    assert np.allclose(true[:3, 3] - [0.5, 0.1, 0.8], error.camera_shift)
    assert np.allclose(true[:3, :3], matrix @ Rotation.from_rotvec(error.camera_turn).as_matrix())


@pytest.mark.parametrize(
    "noise", [dict(arm_position_std=-1.0), dict(finger_force=(5, 2)), dict(finger_force=(0, 2)), dict(x=1)]
)
def test_what_cannot_be_is_refused(noise):
    with pytest.raises(ValidationError):
        ExecutionNoise(**noise)
