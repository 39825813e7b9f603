"""What a cell's file says about a Franka arm."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from mskgrasp.core.config import Config
from mskgrasp.core.panda_kinematics import JOINT_LOWER, JOINT_UPPER

Seven = tuple[float, float, float, float, float, float, float]
Robot = Literal["panda", "fr3"]

# Franka Control Interface documentation, "Robot limits"; Panda is the Franka Emika Robot, FR3 the Research 3.
_JOINT_LOWER: dict[Robot, Seven] = {
    "panda": JOINT_LOWER,
    "fr3": (-2.7437, -1.7837, -2.9007, -3.0421, -2.8065, 0.5445, -3.0159),
}
_JOINT_UPPER: dict[Robot, Seven] = {
    "panda": JOINT_UPPER,
    "fr3": (2.7437, 1.7837, 2.9007, -0.1518, 2.8065, 4.5169, 3.0159),
}
JOINT_SPEED = np.array([2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61])
"""Greatest joint speeds, rad/s (the Panda's; the FR3's are no lower)."""


class FrankaArmConfig(Config):
    """Settings of a Panda or FR3 with the Franka Hand; the defaults are meant for a first day."""

    host: str = Field(min_length=1)
    """Name or address of the robot's control, as in Desk."""
    robot: Robot = "panda"
    """Whose joint limits hold."""
    joint_margin: float = Field(default=0.05, ge=0, le=0.5)
    """The arm keeps this far from its joint limits, rad."""
    max_speed: float = Field(default=0.25, gt=0, le=1.0)
    """The TCP is never faster on a straight line, whatever a program asks for, m/s."""
    max_joint_speed: float = Field(default=0.3, gt=0, le=1.0)
    """No joint is ever faster, as a share of its greatest speed."""
    acceleration: float = Field(default=1.0, gt=0, le=5.0)
    """Of the TCP on a straight line, m/s^2."""
    joint_acceleration: float = Field(default=2.0, gt=0, le=7.5)
    """Of each joint, and of the hand's turn, rad/s^2."""
    contact_torque: float = Field(default=20.0, gt=0, le=80)
    """Torque from outside on a joint that stops the arm by the robot's own reflex, N m."""
    contact_force: float = Field(default=20.0, gt=0, le=80)
    """Force at the TCP that does the same, N."""
    max_grasp_force: float = Field(default=40.0, gt=0, le=70)
    """Greatest grip, N (Franka Hand: 70 N continuously)."""
    gripper_speed: float = Field(default=0.05, gt=0, le=0.1)
    """Of the pads, m/s."""
    closed_width: float = Field(default=1e-3, ge=0, le=0.01)
    """Pads that report this distance or less hold nothing, m."""
    connect_timeout_s: float = Field(default=10.0, gt=0, le=120)
    """A robot that another program holds never answers: given up after this, s."""
    patience_s: float = Field(default=5.0, ge=1, le=120)
    """A driver whose answer is overdue by this hangs, and is ended, s."""
    settle_s: float = Field(default=1.5, gt=0, le=10)
    """The arm may take this long to come to rest at a goal, s."""
    realtime: bool = False
    """Insist on real-time scheduling: true on a PREEMPT_RT kernel, false elsewhere."""

    def joint_lower(self) -> np.ndarray:
        """(7,) radians, the margin taken off."""
        return np.array(_JOINT_LOWER[self.robot]) + self.joint_margin

    def joint_upper(self) -> np.ndarray:
        """(7,) radians, the margin taken off."""
        return np.array(_JOINT_UPPER[self.robot]) - self.joint_margin


class FrankyArmConfig(FrankaArmConfig):
    """An arm driven by franky: the robot's own joint position control."""

    driver: Literal["franky"]


class PandaPyArmConfig(FrankaArmConfig):
    """An arm driven by panda_py: joint impedance, with a slow correction at the goal."""

    driver: Literal["panda_py"]
    stiffness: Seven = (600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0)
    """Of the joints, N m/rad; panda_py's own default."""
    damping: Seven = (50.0, 50.0, 50.0, 20.0, 20.0, 20.0, 10.0)
    """Of the joints, N m s/rad; panda_py's own default."""
