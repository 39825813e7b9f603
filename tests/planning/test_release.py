"""Fingers open until they are clear of what is above them, and no farther than they have room."""

import dataclasses

import numpy as np
import pytest

from hal.execute import LEAST_RELEASE, RELEASE
from mskgrasp.core.grasp import FINGER_THICKNESS, Grasp
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.planning.release import release_opening
from tests import synthetic
from tests.planning.hand_made import FRAME, planner
from tests.synthetic import Box

X, Y, YAW = 0.45, 0.02, 0.4
WIDTH = 0.01
PLAN = planner().plan(FRAME, np.random.default_rng(0))


def plan(z: float, *, displacement: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)) -> GraspPlan:
    """A grasp of what stands at (X, Y), closing along y at YAW."""
    return dataclasses.replace(
        PLAN,
        grasp=Grasp.from_vector(np.array([X, Y, z, YAW])),
        grasp_displacement=np.array(displacement),
    )


def box(width: float, height: float, *, aside: float = 0.0) -> Box:
    """A box that is so wide along the closing direction; its middle is so far aside of the hand's."""
    x, y = X - aside * np.sin(YAW), Y + aside * np.cos(YAW)
    return Box(x=x, y=y, yaw=YAW, size=(0.05, width, height))


def test_fingers_in_the_open_give_a_centimetre_each():
    frame = synthetic.frame([box(WIDTH, 0.03)])
    assert release_opening(frame, plan(0.0155), WIDTH) == pytest.approx(WIDTH + RELEASE)


def test_fingers_beneath_an_overhang_open_until_they_are_clear_of_it():
    """The pads reach up to 24.5 mm; the part is 50 mm wide above them, and 10 mm between them."""
    frame = synthetic.frame([box(0.05, 0.03)])
    opening = release_opening(frame, plan(0.0155), WIDTH)
    assert 0.05 < opening < 0.05 + 0.01
    # The part has slid: the overhang reaches farther on one side.
    slid = release_opening(frame, plan(0.0155, displacement=(0.0, 0.004, 0.0, 0.0)), WIDTH)
    assert slid == pytest.approx(opening + 0.008, abs=0.002)


def test_an_overhang_that_no_opening_is_clear_of_changes_nothing():
    frame = synthetic.frame([box(0.09, 0.03)])
    assert release_opening(frame, plan(0.0155), WIDTH) == 0.0


def test_what_the_pads_reach_over_is_no_overhang():
    """A step of the part beside the pads, lower than these."""
    frame = synthetic.frame([box(0.05, 0.02), box(WIDTH, 0.03)])
    assert release_opening(frame, plan(0.0355), WIDTH) == pytest.approx(WIDTH + RELEASE)


def test_fingers_open_no_farther_than_to_a_wall_beside_them():
    room = 0.007  # beside the back of a closed finger
    wall = box(0.01, 0.03, aside=WIDTH / 2 + FINGER_THICKNESS + room + 0.005)
    frame = synthetic.frame([box(WIDTH, 0.03), wall])
    opening = release_opening(frame, plan(0.0155), WIDTH)
    assert WIDTH + LEAST_RELEASE <= opening <= WIDTH + 2 * room
    assert opening == pytest.approx(WIDTH + 2 * room, abs=0.005)  # a pixel is 2.2 mm


def test_fingers_without_any_room_open_by_the_least_that_releases():
    wall = box(0.01, 0.03, aside=WIDTH / 2 + FINGER_THICKNESS + 0.005)
    frame = synthetic.frame([box(WIDTH, 0.03), wall])
    assert release_opening(frame, plan(0.0155), WIDTH) == pytest.approx(WIDTH + LEAST_RELEASE)


def test_noise_of_the_table_does_not_count_as_a_wall():
    frame = synthetic.frame([box(WIDTH, 0.03)])
    noise = np.random.default_rng(1).normal(0.0, 0.001, frame.depth.shape).astype(np.float32)
    noisy = dataclasses.replace(frame, depth=frame.depth + noise)
    assert release_opening(noisy, plan(0.0115), WIDTH) == pytest.approx(WIDTH + RELEASE)


def test_a_wide_part_leaves_the_hand_as_far_open_as_it_gets():
    frame = synthetic.frame([box(0.07, 0.03)])
    assert release_opening(frame, plan(0.0155), 0.07) == pytest.approx(0.08)
