"""Outline of the hand as boxes."""

from __future__ import annotations

import numpy as np
import pytest

from mskgrasp.core.grasp import MAX_OPENING, PAD_REACH
from mskgrasp.reports.hand_boxes import hand_boxes


@pytest.mark.parametrize("width", [0.0, 0.03, MAX_OPENING])
def test_the_pads_are_as_far_apart_as_the_width_and_reach_below_the_grasp(width: float):
    left, right, palm = hand_boxes(width)
    assert right.bounds[0, 1] - left.bounds[1, 1] == pytest.approx(width)
    np.testing.assert_allclose([left.bounds[0, 2], right.bounds[0, 2]], -PAD_REACH)
    assert palm.bounds[0, 2] == pytest.approx(left.bounds[1, 2])
