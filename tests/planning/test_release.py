"""Fingers open until they are clear of what is above them, and no farther than they have room."""

import dataclasses

import numpy as np
import pytest

from hal.camera import RgbdFrame
from hal.execute import LEAST_RELEASE, RELEASE
from mskgrasp.core.grasp import FINGER_THICKNESS, MAX_OPENING, Grasp
from mskgrasp.perception.part_detection import view_part
from mskgrasp.planning.release import release_opening
from tests import synthetic
from tests.planning.hand_made import FRAME, planner
from tests.synthetic import OVERHEAD, REGION, TILTED, Box

X, Y, YAW = 0.45, 0.02, 0.4
WIDTH = 0.01
PLAN = planner().plan(FRAME, np.random.default_rng(0))
STAYS = (1e-6, 0.0, 0.0, 0.0)
"""A displacement that is predicted, of a part that stays where it is."""


def opening(frame: RgbdFrame, z: float, *, displacement: tuple[float, ...] = STAYS, width: float = WIDTH):
    """For a grasp of what stands at (X, Y), closing along y at YAW."""
    plan = dataclasses.replace(
        PLAN,
        grasp=Grasp.from_vector(np.array([X, Y, z, YAW])),
        grasp_displacement=np.array(displacement),
        view=view_part(frame.depth, frame.intrinsics, frame.T_base_camera, table_z=0.0, region=REGION),
    )
    return release_opening(frame, plan, width)


def box(width: float, height: float, *, aside: float = 0.0) -> Box:
    """A box that is so wide along the closing direction; its middle is so far aside of the hand's."""
    x, y = X - aside * np.sin(YAW), Y + aside * np.cos(YAW)
    return Box(x=x, y=y, yaw=YAW, size=(0.05, width, height))


def beside_a_wall(room: float) -> RgbdFrame:
    """A part whose wall is so far from the back of a closed finger; a thin floor joins it to what is held."""
    aside = WIDTH / 2 + FINGER_THICKNESS + room + 0.005
    return synthetic.frame(
        [box(WIDTH, 0.03), box(0.01, 0.03, aside=aside), box(aside, 0.004, aside=aside / 2)]
    )


@pytest.mark.parametrize("camera", [OVERHEAD, TILTED])
def test_fingers_in_the_open_give_a_centimetre_each(camera):
    frame = synthetic.frame([box(WIDTH, 0.03)], camera)
    assert opening(frame, 0.0155) == pytest.approx(WIDTH + RELEASE)


@pytest.mark.parametrize("camera", [OVERHEAD, TILTED])
def test_fingers_beneath_an_overhang_open_until_they_are_clear_of_it(camera):
    """The pads reach up to 24.5 mm; the part is 50 mm wide above them, and 10 mm between them."""
    frame = synthetic.frame([box(0.05, 0.03)], camera)
    clear = opening(frame, 0.0155)
    assert 0.052 < clear < 0.05 + 0.01
    # The part has slid: the overhang reaches farther on one side.
    assert opening(frame, 0.0155, displacement=(0.0, 0.004, 0.0, 0.0)) == pytest.approx(
        clear + 0.008, abs=0.002
    )


def test_a_small_overhang_takes_no_less_than_the_usual_opening():
    assert opening(synthetic.frame([box(0.02, 0.03)]), 0.0155) == pytest.approx(WIDTH + RELEASE)


@pytest.mark.parametrize("flange", [0.078, 0.09])
def test_beneath_an_overhang_that_reaches_too_far_the_hand_opens_as_far_as_it_does(flange):
    assert opening(synthetic.frame([box(flange, 0.03)]), 0.0155) == MAX_OPENING


def test_what_the_pads_reach_over_is_no_overhang():
    """A step of the part beside the pads, lower than these."""
    frame = synthetic.frame([box(0.05, 0.02), box(WIDTH, 0.03)])
    assert opening(frame, 0.0355) == pytest.approx(WIDTH + RELEASE)


def test_fingers_open_no_farther_than_to_a_wall_of_the_part():
    room = 0.007
    found = opening(beside_a_wall(room), 0.0155)
    assert WIDTH + LEAST_RELEASE <= found <= WIDTH + 2 * room
    assert found == pytest.approx(WIDTH + 2 * room, abs=0.005)  # a pixel is 2.2 mm


def test_fingers_without_any_room_open_by_the_least_that_releases():
    assert opening(beside_a_wall(0.0), 0.0155) == pytest.approx(WIDTH + LEAST_RELEASE)


def test_what_lies_beside_the_part_where_it_was_fed_is_no_wall():
    wall = box(0.01, 0.03, aside=WIDTH / 2 + FINGER_THICKNESS + 0.005)
    assert opening(synthetic.frame([box(0.02, 0.03), wall]), 0.0155, width=0.02) == pytest.approx(
        0.02 + RELEASE
    )


@pytest.mark.parametrize("std", [0.001, 0.003])
def test_noise_of_the_table_is_no_wall(std):
    frame = synthetic.frame([box(WIDTH, 0.03)])
    depth = frame.depth + np.random.default_rng(1).normal(0.0, std, frame.depth.shape).astype(np.float32)
    depth[::7, ::5] = np.nan
    assert opening(dataclasses.replace(frame, depth=depth), 0.0115) == pytest.approx(WIDTH + RELEASE)


@pytest.mark.parametrize("displacement", [(0.0, 0.0, 0.0, 0.0), (np.nan,) * 4])
def test_without_a_prediction_what_is_beside_the_fingers_is_not_known(displacement):
    assert opening(synthetic.frame([box(0.05, 0.03)]), 0.0155, displacement=displacement) is None


def test_a_wide_part_leaves_the_hand_as_far_open_as_it_gets():
    assert opening(synthetic.frame([box(0.07, 0.03)]), 0.0155, width=0.07) == pytest.approx(0.08)
