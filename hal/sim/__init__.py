"""The simulated cell: a Panda and an overhead camera in SAPIEN, as a backend of ``hal``."""

from hal.sim.alone import SapienCameraConfig, sapien_camera
from hal.sim.arm import SapienArm
from hal.sim.camera import SapienCamera
from hal.sim.cell import SapienCellConfig, sapien_cell
from hal.sim.noise import SensorNoise

__all__ = [
    "SapienArm", "SapienCamera", "SapienCameraConfig", "SapienCellConfig", "SensorNoise", "sapien_camera",
    "sapien_cell",
]  # fmt: skip
