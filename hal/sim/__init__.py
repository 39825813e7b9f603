"""The simulated cell: a Panda and an overhead camera in SAPIEN, as a backend of ``hal``."""

from hal.sim.alone import SapienCameraConfig, sapien_camera
from hal.sim.arm import SapienArm
from hal.sim.camera import SapienCamera
from hal.sim.cell import SapienCellConfig, sapien_cell

__all__ = [
    "SapienArm", "SapienCamera", "SapienCameraConfig", "SapienCellConfig", "sapien_camera", "sapien_cell",
]  # fmt: skip
