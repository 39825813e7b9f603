"""A pushed bar in MuJoCo against quasi-static mechanics."""

from __future__ import annotations

import numpy as np
import pytest

from mskgrasp.core.settings import Physics
from tests.benchmarks.pushing import SIZE, in_mujoco, on_paper, slid
from tests.benchmarks.quasi_static import corners


@pytest.mark.parametrize("speed", [0.01, Physics().finger_speed])
def test_a_pushed_bar_moves_in_mujoco_as_on_paper(speed: float):
    """At the fingers' speed contacts that chatter let the bar slide along the pad, by 0.5 mm."""
    physics = Physics()
    moved = in_mujoco(physics, speed, over=False)
    expected = on_paper(physics, corners(*SIZE[:2]))
    assert moved[:2] == pytest.approx(expected[:2], abs=2e-4)
    assert moved[2] == pytest.approx(expected[2], abs=np.radians(0.5))


@pytest.mark.parametrize("over", [False, True])
def test_a_bar_that_two_pads_turn_does_not_slide_along_itself_in_mujoco(over: bool):
    moved = in_mujoco(Physics(), 0.01, over, between=True)
    assert moved[2] > np.radians(20.0)
    assert slid(moved) == pytest.approx(0.0, abs=2e-5)
