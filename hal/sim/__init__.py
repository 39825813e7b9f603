"""The simulated cell: a Panda and an overhead camera in SAPIEN, as a backend of ``hal``."""

from hal.sim.alone import sapien_camera
from hal.sim.arm import SapienArm
from hal.sim.camera import SapienCamera
from hal.sim.cell import sapien_cell
from hal.sim.config import SapienCameraConfig, SapienCellConfig
from hal.sim.film import EDGE, Film, FilmFrame, View
from hal.sim.world import SapienWorld

__all__ = [
    "EDGE", "Film", "FilmFrame", "SapienArm", "SapienCamera", "SapienCameraConfig", "SapienCellConfig",
    "SapienWorld", "View", "sapien_camera", "sapien_cell",
]  # fmt: skip
