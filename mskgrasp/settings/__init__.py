"""What is simulated, as plain settings: known without the simulator, which takes seconds to load."""

from mskgrasp.settings.execution import ExecutionError, ExecutionNoise
from mskgrasp.settings.overhead import Overhead
from mskgrasp.settings.physics import Physics
from mskgrasp.settings.table import REGION, TABLE_Z, Region
from mskgrasp.settings.tape import Tape

__all__ = [
    "REGION", "TABLE_Z", "ExecutionError", "ExecutionNoise", "Overhead", "Physics", "Region", "Tape",
]  # fmt: skip
