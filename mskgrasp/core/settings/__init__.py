"""Settings of the simulated cell; importing them does not load the simulator."""

from mskgrasp.core.settings.execution import ExecutionError, ExecutionNoise
from mskgrasp.core.settings.overhead import Overhead
from mskgrasp.core.settings.physics import Physics
from mskgrasp.core.settings.table import REGION, TABLE_Z, Region
from mskgrasp.core.settings.tape import Tape

__all__ = [
    "REGION", "TABLE_Z", "ExecutionError", "ExecutionNoise", "Overhead", "Physics", "Region", "Tape",
]  # fmt: skip
