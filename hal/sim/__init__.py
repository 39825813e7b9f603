"""The simulated cell: a Panda and an overhead camera in SAPIEN, behind the interfaces of ``hal``."""

from hal.sim.arm import SapienArm
from hal.sim.camera import SapienCamera
from hal.sim.cell import SapienCellConfig, sapien_cell

__all__ = ["SapienArm", "SapienCamera", "SapienCellConfig", "sapien_cell"]
