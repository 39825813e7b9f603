"""Configuration of a Franka arm."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from hal.gripper import FRANKA_HAND
from mskgrasp.core.config import Config
from mskgrasp.core.panda_body import HAND_MASS, PAYLOAD
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


LOAD_SHARE = 0.8
"""Share of the reflex's thresholds that a part's weight may take; the rest is for motion and model errors."""
_GRAVITY = 9.81


class FrankaArmConfig(Config):
    """Settings of a Panda or FR3 with the Franka Hand; the defaults are cautious."""

    host: str = Field(min_length=1)
    """Host name or address of the robot's controller, as in Desk."""
    robot: Robot = "panda"
    """Model, which decides the joint limits."""
    joint_margin: float = Field(default=0.05, ge=0, le=0.5)
    """Margin to the joint limits, rad."""
    max_speed: float = Field(default=0.1, gt=0, le=1.0)
    """Greatest speed of the TCP on a straight line, also if a program requests more, m/s."""
    max_joint_speed: float = Field(default=0.15, gt=0, le=1.0)
    """Greatest joint speed, as a fraction of the joint's limit."""
    acceleration: float = Field(default=1.0, gt=0, le=5.0)
    """Acceleration of the TCP on a straight line, m/s^2."""
    joint_acceleration: float = Field(default=2.0, gt=0, le=7.5)
    """Acceleration of each joint, and of the hand's rotation, rad/s^2."""
    contact_torque: float = Field(default=15.0, gt=0, le=80)
    """External torque on a joint at which the robot's reflex stops the arm, N m."""
    contact_force: float = Field(default=15.0, gt=0, le=80)
    """External force at the TCP at which the reflex stops the arm, N."""
    max_grasp_force: float = Field(default=30.0, gt=0, le=FRANKA_HAND.force[1])
    """Greatest gripper force, N (Franka Hand: 70 N continuously)."""
    gripper_speed: float = Field(default=0.05, gt=0, le=FRANKA_HAND.speed[1])
    """Speed at which the pads' distance changes, twice that of each finger, m/s."""
    closed_width: float = Field(default=1e-3, ge=0, le=0.01)
    """Pads at this distance or less hold nothing, m: as they close, and after the lift."""
    connect_timeout_s: float = Field(default=10.0, gt=0, le=120)
    """Time a robot has to accept the connection, s; one that another program holds never answers."""
    patience_s: float = Field(default=5.0, ge=1, le=120)
    """A driver whose answer is overdue by this is killed, s."""
    settle_s: float = Field(default=1.5, gt=0, le=10)
    """Time the arm has to come to rest at a goal, s."""
    realtime: bool = False
    """Require real-time scheduling: true on a PREEMPT_RT kernel, false elsewhere."""

    def max_load(self, reach: float) -> float:
        """Greatest mass of a part, kg, whose weight the thresholds of the reflex hold, up to the payload.

        As the part leaves the table, the robot takes the weight for a contact: until then what it was told
        it holds is still carried by the table.

        Args:
            reach: Greatest horizontal distance of the hand from the base, metres.
        """
        by_force, by_torque = self.contact_force / _GRAVITY, self.contact_torque / (_GRAVITY * reach)
        return min(LOAD_SHARE * min(by_force, by_torque), PAYLOAD - HAND_MASS)

    def joint_lower(self) -> np.ndarray:
        """(7,) radians, less the margin."""
        return np.array(_JOINT_LOWER[self.robot]) + self.joint_margin

    def joint_upper(self) -> np.ndarray:
        """(7,) radians, less the margin."""
        return np.array(_JOINT_UPPER[self.robot]) - self.joint_margin


class FrankyArmConfig(FrankaArmConfig):
    """An arm driven by franky: the robot's own joint position control."""

    driver: Literal["franky"]


class PandaPyArmConfig(FrankaArmConfig):
    """An arm driven by panda_py: joint impedance, with a slow correction at the goal."""

    driver: Literal["panda_py"]
    stiffness: Seven = (600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0)
    """Stiffness of the joints, N m/rad; panda_py's own default."""
    damping: Seven = (50.0, 50.0, 50.0, 20.0, 20.0, 20.0, 10.0)
    """Damping of the joints, N m s/rad; panda_py's own default."""
