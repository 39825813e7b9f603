"""Figures of an assessment."""

from __future__ import annotations

import numpy as np

from mskgrasp.assess.config import parse_tolerance
from mskgrasp.assess.figures import draw_grasps, draw_shares, drawn_poses
from mskgrasp.assess.summary import summarise
from mskgrasp.assess.trials import NOISY
from mskgrasp.core.grasp import TILT_LIMIT
from tests.assess.made_trials import failed, made
from tests.figures import picture
from tests.planning.test_certified import PART, certified, certified_grasp


def blue(image: np.ndarray) -> int:
    """Number of pixels in the colour of the best grasp and of the prediction."""
    blue_, _, red = np.moveaxis(image[..., :3].astype(int), -1, 0)  # as OpenCV reads it
    return int(((blue_ - red) > 120).sum())


def test_shares_are_drawn_for_each_condition(tmp_path):
    trials = [made(0), made(1, planner="networks"), made(0, condition=NOISY), failed(1, condition=NOISY)]
    one, two = (trials[:2], trials)
    widths = []
    for number, some in enumerate((one, two)):
        rows = summarise(some, parse_tolerance("1mm,2deg"), TILT_LIMIT)
        draw_shares(some, rows, 1e-3, tmp_path / f"{number}.png")
        image = picture(tmp_path / f"{number}.png")
        assert blue(image) > 200
        widths.append(image.shape[1])
    assert widths[1] == 2 * widths[0]


def test_the_best_grasp_is_blue_and_a_pose_without_grasps_is_drawn_too(tmp_path):
    for name, grasps in (("some", certified(certified_grasp())), ("none", certified())):
        draw_grasps(PART, grasps, tmp_path / f"{name}.png")
    some, none = (picture(tmp_path / f"{name}.png") for name in ("some", "none"))
    assert blue(some) > 200 and blue(none) == 0
    assert some.shape == none.shape


def test_poses_that_are_alike_are_drawn_once_and_count_together():
    n = len(PART.resting_probability)
    order = np.argsort(-PART.resting_probability, kind="stable").tolist()
    assert drawn_poses(PART, certified(like={})) == order[:6]
    # All but the most probable one are like the least probable: together they exceed it.
    like = {number: (order[-1], 0.0) for number in order[1:-1]}
    assert n > 2 and PART.resting_probability[order[0]] < 0.5
    assert drawn_poses(PART, certified(like=like)) == [order[-1], order[0]]
