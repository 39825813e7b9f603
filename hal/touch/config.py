"""Configuration of a measurement of the table."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from hal.arm import MAX_TOUCH_FORCE, MAX_TOUCH_SPEED
from mskgrasp.core.config import Config


class TouchConfig(Config):
    """Settings of one measurement."""

    cell: Path
    """YAML file of the cell, for example configs/cells/panda_kinect2.yaml."""
    out: Path = Path("out/touch")
    """Folder for the report: table.json and table.png."""
    table_at: float | None = Field(default=None, ge=-0.5, le=0.5)
    """Height of the table over the robot's base by tape, m; required while the file says table_z: null."""
    search: float = Field(default=0.03, gt=0, le=0.03)
    """The table is searched this far above and below where it should be, m."""
    force: float = Field(default=5.0, ge=1.0, le=MAX_TOUCH_FORCE)
    """Force on the fingers that is a touch, N; less than the arm's contact_force."""
    speed: float = Field(default=0.01, gt=0, le=MAX_TOUCH_SPEED / 2)
    """Speed towards the table, m/s; twice as much for the first contact."""
    flatness: float = Field(default=0.0005, gt=0, le=0.005)
    """Greatest distance of a touched point from the plane, m."""
    yes: bool = False
    """Ask nothing: the region is clear, the arm may move, and a real cell's file is rewritten."""
