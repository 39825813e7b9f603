"""The region on the table is within reach of the arm, with every angle of the hand."""

from __future__ import annotations

import itertools

import numpy as np

from mskgrasp.core.grasp import lowest_grasp_z
from mskgrasp.core.panda_kinematics import top_down
from mskgrasp.core.settings import REGION, TABLE_Z, Physics


def test_every_grasp_in_the_region_can_be_executed_and_lifted():
    x_min, x_max, y_min, y_max = REGION
    low = lowest_grasp_z(TABLE_Z)
    grid = itertools.product(
        np.linspace(x_min, x_max, 7), np.linspace(y_min, y_max, 7),
        np.linspace(low, low + 0.1 + Physics().lift_height, 4), np.linspace(-np.pi / 2, np.pi / 2, 9),
    )  # fmt: skip
    assert top_down(np.array(list(grid)))[1].all()


def test_the_region_is_a_square_of_24_cm_before_the_arm():
    x_min, x_max, y_min, y_max = REGION
    np.testing.assert_allclose([x_max - x_min, y_max - y_min], 0.24)
    assert y_min == -y_max and x_min > 0.3  # the foot of the arm is at 0
