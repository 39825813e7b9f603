"""Why a part is not tried, from images of boxes; the hand opens 80 mm."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from hal import RgbdFrame
from mskgrasp.core.errors import GraspRefused
from mskgrasp.core.grasp import PAD_REACH
from mskgrasp.planning.config import MIN_QUALITY, PlannerConfig
from tests import synthetic
from tests.planning.hand_made import planner
from tests.synthetic import Box

DEMANDING = PlannerConfig(n_candidates=300, min_quality=0.999)


def refusal(frame: RgbdFrame, **settings) -> GraspRefused:
    with pytest.raises(GraspRefused) as caught:
        planner(DEMANDING, **settings).plan(frame, np.random.default_rng(0))
    assert "\n" not in str(caught.value)
    return caught.value


@pytest.mark.parametrize("yaw", [0.0, 0.4, 0.785])
def test_a_part_wider_than_the_hand_opens_is_named_as_such(yaw: float):
    wide = synthetic.frame([Box(x=0.5, y=0.0, yaw=yaw, size=(0.1, 0.09, 0.03))])
    error = refusal(wide)
    assert str(error).startswith(f"no grasp found (best quality {error.quality:.2f}): the part is wider than")
    assert any(f"({mm} mm at its narrowest, 80 mm)" in str(error) for mm in range(85, 92))


def test_a_long_part_that_the_hand_spans_is_not_called_wide():
    """The model here predicts too little everywhere, which is another reason."""
    error = refusal(synthetic.frame([Box(x=0.5, y=0.0, yaw=0.4, size=(0.12, 0.02, 0.03))]))
    assert "the model predicts less than planner.min_quality 0.999 for every grasp" in str(error)


def test_a_part_between_two_walls_is_not_called_wide():
    walls = [
        Box(x=0.5, y=0.0, yaw=0.0, size=(0.06, 0.04, 0.03)),
        *(Box(x=0.5, y=y, yaw=0.0, size=(0.2, 0.02, 0.05)) for y in (-0.055, 0.055)),
        *(Box(x=x, y=0.0, yaw=0.0, size=(0.03, 0.06, 0.05)) for x in (0.44, 0.56)),
    ]
    frame = synthetic.frame(walls)
    some = planner(DEMANDING)
    view = synthetic.view(synthetic.render(walls[:1]))
    grasps = np.column_stack([np.tile([0.5, 0.0, 0.02], (30, 1)), np.linspace(-1.5, 1.5, 30)])
    with pytest.raises(GraspRefused, match="something is in the way of the open fingers"):
        some.refuse_poor(frame, view, grasps, np.array([0.1]))


def test_a_part_lower_than_the_fingers_stay_over_the_table_is_named_as_such():
    flat = synthetic.frame([Box(x=0.5, y=0.0, yaw=0.0, size=(0.05, 0.03, 0.004))])
    error = refusal(flat, lowest_grasp_z=lambda xy: np.full(len(xy), PAD_REACH + 0.006))
    assert "the part is 4.0 mm high, and the fingers stay 6.0 mm over the table" in str(error)


def test_a_refusal_keeps_its_message_and_quality_in_another_process():
    error = GraspRefused("no grasp found (best quality 0.00): the part is wider than the hand opens", 0.0021)
    assert str(error) == "no grasp found (best quality 0.00): the part is wider than the hand opens"
    again = copy.copy(error)  # by the same protocol as between processes
    assert (str(again), again.quality, again.exit_code) == (str(error), 0.0021, 1)


def test_a_bound_is_set_for_motion_only_and_a_users_own_is_kept():
    assert PlannerConfig().least_quality == 0
    assert PlannerConfig(n_candidates=40).for_motion().least_quality == MIN_QUALITY == 0.5
    assert PlannerConfig(min_quality=0.0).for_motion().least_quality == 0
    assert PlannerConfig(min_quality=0.9).for_motion().least_quality == 0.9
