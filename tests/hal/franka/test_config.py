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


@pytest.mark.parametrize(
    ("force", "torque", "reach", "mass"),
    [
        (15.0, 15.0, 0.85, 0.8 * 15 / 9.81),  # of the force
        (40.0, 15.0, 0.85, 0.8 * 15 / 9.81 / 0.85),  # of the torque, the arm stretched out
        (80.0, 80.0, 0.85, 2.27),  # of the payload of 3 kg less the hand
    ],
)
def test_a_part_may_weigh_what_the_weakest_threshold_holds(
    force: float, torque: float, reach: float, mass: float
):
    arm = PandaPyArmConfig(driver="panda_py", host="x", contact_force=force, contact_torque=torque)
    assert arm.max_load(reach) == pytest.approx(mass)
