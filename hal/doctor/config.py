"""Configuration of a cell's diagnosis."""

from __future__ import annotations

from pathlib import Path

from mskgrasp.core.config import Config


class DoctorConfig(Config):
    """Settings of one diagnosis."""

    cell: Path
    """YAML file of the cell, for example configs/cells/panda_kinect2.yaml."""
    move: bool = False
    """Also move every joint by 0.03 rad and back, and the fingers (they drop what they hold)."""
    gripper: bool = False
    """Instead measure the force and speed of a real hand with its operator, and write them into the file."""
