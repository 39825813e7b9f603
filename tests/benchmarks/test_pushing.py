"""A pushed bar in MuJoCo against quasi-static mechanics."""

from __future__ import annotations

import numpy as np
import pytest

from mskgrasp.core.settings import Physics
from tests.benchmarks.pushing import SIZE, in_mujoco, on_paper
from tests.benchmarks.quasi_static import corners


def test_a_slowly_pushed_bar_moves_in_mujoco_as_on_paper():
    physics = Physics()
    moved = in_mujoco(physics, 0.01, over=False)
    expected = on_paper(physics, corners(*SIZE[:2]))
    assert moved[:2] == pytest.approx(expected[:2], abs=2e-4)
    assert moved[2] == pytest.approx(expected[2], abs=np.radians(0.5))
