"""Franka arms, Panda and FR3, driven by franky or panda_py, which are imported in a separate process."""

from hal.franka.arm import FrankaArm
from hal.franka.config import FrankyArmConfig, PandaPyArmConfig

__all__ = ["FrankaArm", "FrankyArmConfig", "PandaPyArmConfig"]
