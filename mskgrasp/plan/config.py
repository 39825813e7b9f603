"""Settings of planning one grasp."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from mskgrasp.core.config import Config
from mskgrasp.core.shipped import PRETRAINED, SIMULATED_CELL
from mskgrasp.core.units import Unit
from mskgrasp.planning.config import PlannerConfig


class PlanConfig(Config):
    """Settings of planning one grasp."""

    models: Path = PRETRAINED
    """Folder with model.safetensors and model.json; by default the shipped one."""
    cell: Path = SIMULATED_CELL
    """YAML file of the cell; by default the simulated one."""
    out: Path = Path("out/plan")
    """Folder for plan.png and plan.json."""
    part: str | None = None
    """Place this part (a name, a folder or a CAD file) on the table first; the cell needs a feeder. With
    --planner.policy certified on a cell without one: the part that lies there."""
    unit: Unit | None = None
    """Unit of a CAD file's coordinates, where the format states none; mm if not given."""
    go_home: bool = False
    """Move the arm home first, out of the camera's view; the operator of a real cell is asked."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Determines the candidates, and the place of --part."""
    planner: PlannerConfig = PlannerConfig()
    """Settings of the choice of the grasp."""
