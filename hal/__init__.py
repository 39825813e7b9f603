"""Hardware abstraction: cameras, arms and cells; a YAML file chooses their backends."""

from hal.arm import Arm
from hal.arm_state import ArmState, GraspOutcome
from hal.backends import Backend
from hal.camera import Camera, RgbdFrame
from hal.cell import Cell, PartFeeder, PartTracker, Workspace
from hal.errors import HalError
from hal.execute import GraspResult, capture_at_home, execute_grasp, go_home, let_go, lower, put_down
from hal.gripper import GripperSpec
from hal.hand import Load
from hal.limits import ArmLimits
from hal.open_cell import cell_from_yaml, open_cell
from hal.sensor_noise import SensorNoise
from mskgrasp.core.config import Config as BackendConfig

__all__ = [
    "Arm", "ArmLimits", "ArmState", "Backend", "BackendConfig", "Camera", "Cell", "GraspOutcome",
    "GraspResult", "GripperSpec", "HalError", "Load", "PartFeeder", "PartTracker", "RgbdFrame", "SensorNoise",
    "Workspace", "capture_at_home", "cell_from_yaml", "execute_grasp", "go_home", "let_go", "lower",
    "open_cell", "put_down",
]  # fmt: skip
