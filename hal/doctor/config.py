"""Configuration of a cell's diagnosis."""

from __future__ import annotations

from pathlib import Path

from mskgrasp.core.config import Config


class DoctorConfig(Config):
    """Settings of one diagnosis."""

    cell: Path
    """YAML file of the cell, for example configs/cells/panda_kinect2.yaml."""
    move: bool = False
    """Also move every joint by 0.03 rad and back, and the fingers; nothing moves after a failed check, nor
    while the hand holds something."""
    dry_run: bool = False
    """Also go the whole way of a grasp of nothing, 5 cm over the table, at a tenth of the file's speeds;
    nothing moves after a failed check."""
    gripper: bool = False
    """Instead measure the force and speed of a real hand with its operator, and write them into the file."""
