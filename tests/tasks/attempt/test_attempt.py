"""The task against outcomes that can be worked out on paper."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mskgrasp.core.grasp import FAILURES
from mskgrasp.parts import find_part

MM = 1e-3
DEG = math.pi / 180
Z = 0.02


def reason(outcome: dict) -> str:
    return FAILURES[int(outcome["failure"])]


def test_a_centred_box_does_not_move_in_the_hand(attempt):
    outcome = attempt((0.5, 0.0, Z, 0.0))
    assert outcome["success"] and reason(outcome) == "none"
    assert np.abs(outcome["displacement"][:3]).max() < 0.1 * MM
    assert abs(outcome["displacement"][3]) < 0.2 * DEG
    assert outcome["tilt"] < 0.3 * DEG
    assert outcome["width_after"] == pytest.approx(0.02, abs=0.2 * MM)


@pytest.mark.parametrize("offset", [5 * MM, -5 * MM, 12 * MM])
def test_a_box_off_centre_along_the_closing_direction_ends_centred(attempt, offset):
    outcome = attempt((0.5, 0.0, Z, 0.0), at=(0.5, offset))
    assert outcome["success"]
    assert outcome["displacement"][1] == pytest.approx(-offset, abs=0.15 * MM)
    assert np.abs(outcome["displacement"][[0, 2]]).max() < 0.2 * MM


def test_a_box_off_centre_along_the_pads_stays_where_it_is(attempt):
    outcome = attempt((0.5, 0.0, Z, 0.0), at=(0.505, 0.0))
    assert outcome["success"]
    assert np.abs(outcome["displacement"][:3]).max() < 0.2 * MM
    assert abs(outcome["displacement"][3]) < 0.5 * DEG


@pytest.mark.parametrize("turn", [0.3, -0.4])
def test_a_turned_box_aligns_with_the_pads(attempt, turn):
    outcome = attempt((0.5, 0.0, Z, 0.0), turn=turn)
    assert outcome["success"]
    assert outcome["displacement"][3] == pytest.approx(-turn, abs=0.3 * DEG)


def test_turning_table_and_hand_together_changes_nothing(attempt):
    """The displacement is given in the grasp frame."""
    turn = 0.9
    cos, sin = math.cos(turn), math.sin(turn)
    outcome = attempt((0.5, 0.0, Z, turn), at=(0.5 - 5 * MM * sin, 5 * MM * cos), turn=turn)
    assert outcome["success"]
    assert outcome["displacement"][1] == pytest.approx(-5 * MM, abs=0.15 * MM)


def test_a_pin_held_near_its_end_does_not_swing(env):
    """Its weight, 53 g, 26 mm from the pads, turns it with 0.014 N m; one point of each pad holds 0.15."""
    pose = [0.45296192, -0.07274442, 0.00594181, 0.2986161, 0.4179293, -0.5703816, -0.64095896]
    folder = str(find_part("parallel_pin_12x60").folder)
    env.reset(seed=0, options=dict(parts=[folder], reconfigure=True, pose_base_obj=np.array([pose])))
    grasp = np.array([[0.45158386, -0.06337806, 0.01136792, 1.3311471]], dtype=np.float32)
    info = env.step(grasp)[-1]
    # With 25 iterations in the lift it swings by 15 degrees.
    assert info["success"][0] and math.degrees(float(info["tilt"][0])) < 1.5


def test_an_empty_grasp_is_missed(attempt):
    outcome = attempt((0.5, 0.0, Z, 0.0), at=(0.5, 0.1))
    assert not outcome["success"] and reason(outcome) == "missed"
    assert np.isnan(outcome["displacement"]).all() and np.isnan(outcome["tilt"])


def test_a_part_wider_than_the_hand_opens_is_not_grasped(attempt):
    outcome = attempt((0.5, 0.0, Z, 0.0), part="wide")
    assert not outcome["success"] and reason(outcome) == "collided"  # the fingers land on it


def test_a_finger_that_lands_on_the_part_ends_the_descent(attempt):
    outcome = attempt((0.5, 0.04, Z, 0.0))
    assert reason(outcome) == "collided"


def test_friction_holds_what_it_can_hold_and_no_more(attempt):
    """Two pads hold 2 mu F = 2 * 0.5 * 30 N; the lift adds at most 1.6 m/s^2 to gravity."""
    assert attempt((0.5, 0.0, Z, 0.0), part="heavy")["success"]
    outcome = attempt((0.5, 0.0, Z, 0.0), part="too-heavy")
    assert not outcome["success"] and reason(outcome) == "slipped"


def test_a_part_that_is_not_at_rest_makes_no_label(attempt):
    outcome = attempt((0.5, 0.0, Z, 0.0), height=0.03)
    assert not outcome["success"] and reason(outcome) == "unsettled"


def test_the_displacement_is_that_of_the_recorded_poses(attempt):
    outcome = attempt((0.5, 0.0, Z, 0.4), at=(0.503, 0.004), turn=0.2)
    assert outcome["success"]
    before, after = (np.asarray(outcome[f"pose_tcp_obj_{when}"], dtype=float) for when in ("before", "after"))
    flip = Rotation.from_euler("x", math.pi)
    moved = flip.apply(after[:3] - before[:3])
    turned = flip * Rotation.from_quat(after[3:], scalar_first=True)
    turned = turned * (flip * Rotation.from_quat(before[3:], scalar_first=True)).inv()
    assert np.asarray(outcome["displacement"][:3]) == pytest.approx(moved, abs=1e-6)
    assert float(outcome["displacement"][3]) == pytest.approx(turned.as_euler("ZYX")[0], abs=2e-3)


def test_the_same_attempt_in_a_fresh_scene_gives_the_same_bits(attempt):
    first = attempt((0.5, 0.003, Z, 0.3), at=(0.502, 0.004), turn=1.0)
    attempt((0.5, 0.0, Z, 0.0))
    again = attempt((0.5, 0.003, Z, 0.3), at=(0.502, 0.004), turn=1.0)
    assert np.array_equal(first["displacement"], again["displacement"], equal_nan=True)
    assert np.array_equal(first["pose_tcp_obj_after"], again["pose_tcp_obj_after"])


@pytest.mark.parametrize("grasp", [(0.5, 0.0, 0.005, 0.0), (0.9, 0.0, 0.02, 0.0)])
def test_a_grasp_into_the_table_or_out_of_reach_is_not_tried(attempt, grasp):
    outcome = attempt(grasp)
    assert not outcome["executable"] and not outcome["success"]
    assert reason(outcome) == "unreachable"
    assert attempt((0.5, 0.0, Z, 0.0))["executable"]
