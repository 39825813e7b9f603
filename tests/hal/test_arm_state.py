"""What tells that the fingers have lost something."""

from __future__ import annotations

import numpy as np
import pytest

from hal.arm_state import Held
from mskgrasp.core.geometry import Pose


@pytest.mark.parametrize(
    ("width", "lost"), [(0.030, False), (0.034, False), (0.026, False), (0.036, True), (0.0, True)]
)
def test_fingers_that_have_moved_since_they_closed_have_lost_what_they_held(width: float, lost: bool):
    here = Pose(position=np.zeros(3), quat_wxyz=np.array([1.0, 0.0, 0.0, 0.0]))
    assert Held(T_base_tcp=here, width=0.03).lost(width) is lost
