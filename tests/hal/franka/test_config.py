"""Limits of both robots."""

from __future__ import annotations

import pytest

from hal.franka import FrankyArmConfig, PandaPyArmConfig
from mskgrasp.core.panda_kinematics import JOINT_LOWER, JOINT_UPPER

PANDA = PandaPyArmConfig(driver="panda_py", host="x")
LOWER, UPPER = PANDA.joint_lower(), PANDA.joint_upper()


def test_both_robots_have_their_own_limits():
    fr3 = FrankyArmConfig(driver="franky", host="x", robot="fr3", joint_margin=0.0)
    panda = FrankyArmConfig(driver="franky", host="x", robot="panda", joint_margin=0.0)
    assert panda.joint_lower() == pytest.approx(JOINT_LOWER)
    assert panda.joint_upper() == pytest.approx(JOINT_UPPER)
    assert fr3.joint_lower()[5] == pytest.approx(0.5445)  # FR3: joint 6 does not reach zero
    assert (LOWER > panda.joint_lower()).all() and (UPPER < panda.joint_upper()).all()
