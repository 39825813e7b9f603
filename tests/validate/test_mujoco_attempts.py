"""Attempts in MuJoCo, on a box whose motion in the hand is known."""

from __future__ import annotations

import numpy as np
import pytest

from mskgrasp.core.grasp import FAILURES
from mskgrasp.core.settings import Physics
from mskgrasp.parts import Part
from mskgrasp.validate.mujoco_attempts import mujoco_physics, try_grasp, try_grasps
from tests.boxes import make_box

SIZE = (0.06, 0.02, 0.03)
START = np.array([0.5, 0.0, 0.015, 1.0, 0.0, 0.0, 0.0])
"""Lying at rest; a hand at angle 0 closes along the base's y."""


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory) -> Part:
    return make_box(tmp_path_factory.mktemp("box"), "box", SIZE, 0.1)


def attempt(part: Part, *grasp: float, start: np.ndarray = START) -> dict[str, np.ndarray]:
    return try_grasp(part, start, np.array(grasp), Physics())


def test_a_box_beside_the_middle_ends_in_the_middle(box: Part):
    outcome = attempt(box, 0.49, -0.006, 0.015, 0.0)
    assert bool(outcome["success"]) and bool(outcome["settled"]) and int(outcome["failure"]) == 0
    np.testing.assert_allclose(outcome["displacement"][:3], [0.0, -0.006, 0.0], atol=8e-4)
    assert abs(outcome["displacement"][3]) < np.radians(0.5) and float(outcome["tilt"]) < np.radians(1)
    assert 0 <= float(outcome["penetration"]) < 1e-3 and np.isnan(outcome["fastest"])
    # Approach, closing at 5 cm/s a finger over 3 cm, the lift and its hold.
    assert 1.0 < float(outcome["seconds"]) < 4.0


@pytest.mark.parametrize(
    ("grasp", "failure"),
    [
        ((0.5, 0.0, 0.06, 0.0), "missed"),  # the pads close over the box
        ((0.5, 0.045, 0.015, 0.0), "collided"),  # a finger comes down on it
    ],
)
def test_a_grasp_that_cannot_hold_fails_for_the_stated_reason(box: Part, grasp, failure: str):
    outcome = attempt(box, *grasp)
    assert not bool(outcome["success"]) and FAILURES[int(outcome["failure"])] == failure
    assert np.isnan(outcome["displacement"]).all() and np.isnan(outcome["tilt"])


def test_a_part_that_is_not_at_rest_is_not_grasped(box: Part):
    falling = START + np.array([0, 0, 0.02, 0, 0, 0, 0])
    outcome = attempt(box, 0.5, 0.0, 0.015, 0.0, start=falling)
    assert not bool(outcome["settled"]) and not bool(outcome["success"])


def test_a_grasp_out_of_reach_is_an_error_and_no_outcome(box: Part):
    with pytest.raises(ValueError, match="out of the arm's reach"):
        attempt(box, 1.2, 0.0, 0.015, 0.0)


def test_grasps_are_tried_one_by_one_and_each_is_timed(box: Part):
    grasps = np.array([[0.49, -0.006, 0.015, 0.0], [0.5, 0.0, 0.06, 0.0]], np.float32)
    found = try_grasps(box.folder, np.stack([START, START]), grasps, Physics())
    assert found["success"].tolist() == [True, False] and found["displacement"].shape == (2, 4)
    assert (found["cpu_seconds"] > 0).all()
    alone = try_grasp(box, START, grasps[0].astype(np.float64), Physics())
    np.testing.assert_array_equal(found["displacement"][0], alone["displacement"])


def test_both_engines_have_the_settings_that_both_know():
    physics = Physics(friction_pad_part=0.6, pad_patch_radius=0.004, finger_speed=0.03, reflex_force=15.0)
    found = mujoco_physics(physics)
    assert (found.friction_pad_part, found.pad_patch_radius) == (0.6, 0.004)
    assert (found.finger_speed, found.reflex_force) == (0.03, 15.0)
