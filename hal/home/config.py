"""Configuration of homing a hand."""

from __future__ import annotations

from pathlib import Path

from mskgrasp.core.config import Config


class HomeConfig(Config):
    """Settings of one homing."""

    cell: Path
    """YAML file of the cell, for example configs/cells/panda_kinect2.yaml."""
    yes: bool = False
    """Ask nothing: nothing is between the fingers, and they may move."""
