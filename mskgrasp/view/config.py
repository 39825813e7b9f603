"""Settings of the viewer."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from mskgrasp.core.config import Config
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.core.units import Unit
from mskgrasp.planning.config import PlannerConfig


class ViewConfig(Config):
    """Settings of the viewer."""

    part: str | None = None
    """Part to show and to plan for: a name, a folder or a CAD file. With --data: its attempts come first."""
    unit: Unit | None = None
    """Unit of a CAD file's coordinates, where the format states none; mm if not given."""
    data: Path | None = None
    """Folder of a dataset whose attempts are shown."""
    run: Path | None = None
    """Folder of a run of mskgrasp.evaluate or mskgrasp.palletize whose trials are shown."""
    cell: Path | None = None
    """YAML file of the cell to plan on; null: the simulated one, and none with --data or --run."""
    models: Path = PRETRAINED
    """Folder with model.safetensors and model.json; by default the shipped one."""
    planner: PlannerConfig = PlannerConfig()
    """Settings of the choice of the grasp; min_quality is 0.5 if not set, where plans may be executed."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Determines the place of the part and the candidates."""
    host: str = "127.0.0.1"
    """Address to listen on; any but one of this machine alone needs --allow-remote."""
    port: int = Field(default=8080, ge=0, le=65535)
    """Port to listen on; 0: a free one, which is printed."""
    allow_remote: bool = False
    """Let other machines open the page: whoever opens it can do all that it does."""
    allow_motion: bool = False
    """Enable the buttons that move the arm; each motion is confirmed on the page first."""
