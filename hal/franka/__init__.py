"""Franka arms, Panda and FR3, driven by franky or by panda_py; neither is imported before it connects."""

from hal.franka.arm import FrankaArm
from hal.franka.config import FrankaArmConfig, FrankyArmConfig, PandaPyArmConfig

__all__ = ["FrankaArm", "FrankaArmConfig", "FrankyArmConfig", "PandaPyArmConfig"]
