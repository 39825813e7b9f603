from dataclasses import replace

import numpy as np
import pytest

from mskgrasp.core.geometry import Pose, quat_multiply
from mskgrasp.perception.part_pose.mismatch import Mismatch, reason_to_refuse
from mskgrasp.perception.part_pose.search import search
from tests.perception.part_pose.cells import kinect2, known, posed, resting_at, seen

NAME = "pillow_block_80x32"


def mismatch(cell, pose: Pose, *, noisy: bool = False) -> tuple[Mismatch, str]:
    frame = posed(cell, NAME, pose)
    frame = kinect2(frame, seed=0) if noisy else frame
    pixels = seen(cell, frame, NAME)
    one = Mismatch.of(search(pixels, known(NAME))[0], pixels)
    return one, reason_to_refuse(one, pixels)


@pytest.mark.parametrize("noisy", [False, True])
def test_a_part_in_a_resting_pose_is_explained(mujoco_cell, noisy):
    found, reason = mismatch(mujoco_cell, resting_at(NAME, 0, 0.48, 0.03, 0.3), noisy=noisy)
    assert not reason
    assert found.patch <= 5
    assert abs(found.rise) < 0.5e-3
    assert found.residual < (2e-3 if noisy else 0.3e-3)


@pytest.mark.parametrize(("noisy", "rise"), [(False, 0.6e-3), (True, 1.5e-3)])
def test_the_rise_of_a_raised_part_is_measured(mujoco_cell, noisy, rise):
    flat = resting_at(NAME, 0, 0.48, 0.03, 0.3)
    raised = Pose(position=flat.position + [0, 0, rise], quat_wxyz=flat.quat_wxyz)
    found, reason = mismatch(mujoco_cell, raised, noisy=noisy)
    assert found.rise == pytest.approx(rise, abs=0.3e-3)
    assert "mm from where they would be" in reason


def test_the_tilt_of_a_leaning_part_is_measured(mujoco_cell):
    flat = resting_at(NAME, 0, 0.48, 0.03, 0.3)
    half = np.radians(2.0) / 2
    tilt = np.array([np.cos(half), 0.0, np.sin(half), 0.0])
    leaning = Pose(position=flat.position, quat_wxyz=quat_multiply(tilt, flat.quat_wxyz))
    found, reason = mismatch(mujoco_cell, leaning)
    assert np.degrees(found.tilt) == pytest.approx(2.0, abs=0.5)
    assert "it is tilted by" in reason


FITS = Mismatch(
    pixels=300, excess=0.5, excess_sigma=0.05, patch=2, unexplained=0.01, rise=0.0, rise_sigma=0.05e-3,
    tilt=0.0, tilt_sigma=0.001, residual=1e-3,
)  # fmt: skip


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({}, ""),
        ({"excess": 0.7}, ""),
        ({"excess": 0.85}, "its heights differ by more than noise"),
        ({"excess": 0.85, "excess_sigma": 0.1}, ""),
        ({"patch": 5}, ""),
        ({"patch": 40}, "a patch of 40 pixels differs"),
        ({"unexplained": 0.2}, "20% of its pixels are where the part has no surface"),
        ({"rise": 1e-3}, "its surfaces are +1.0 mm from where they would be"),
        ({"rise": 1e-3, "rise_sigma": 0.3e-3}, ""),
        ({"tilt": 0.05}, "it is tilted by 2.9 degrees"),
        ({"tilt": 0.05, "tilt_sigma": 0.02}, ""),
    ],
)
@pytest.mark.parametrize("noisy", [False, True])
def test_each_difference_that_noise_does_not_explain_refuses_a_part(mujoco_cell, change, reason, noisy):
    frame = posed(mujoco_cell, NAME, resting_at(NAME, 0, 0.48, 0.03, 0.3))
    frame = kinect2(frame, seed=0) if noisy else frame
    told = reason_to_refuse(replace(FITS, **change), seen(mujoco_cell, frame, NAME))
    assert told.startswith(reason) and bool(told) == bool(reason)
