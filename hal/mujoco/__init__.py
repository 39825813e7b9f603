"""A second simulated cell, in MuJoCo, as a backend of ``hal``: an engine independent of SAPIEN's.

Needs the extra ``[mujoco]``, which is loaded when a cell is connected.
"""

from hal.mujoco.cell import mujoco_cell
from hal.mujoco.config import MujocoCellConfig, MujocoPhysics

__all__ = ["MujocoCellConfig", "MujocoPhysics", "mujoco_cell"]
