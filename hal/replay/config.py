"""Configurations of recorded and replayed cells, cameras and arms."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from mskgrasp.core.config import Config


class Tolerances(Config):
    """Greatest differences between a command and the recorded one."""

    position: float = Field(default=1e-3, ge=0)
    """Difference of the TCP's position, m."""
    rotation: float = Field(default=1e-2, ge=0)
    """Difference of the hand's rotation, rad."""
    joints: float = Field(default=5e-3, ge=0)
    """Difference of each joint, rad."""
    width: float = Field(default=5e-4, ge=0)
    """Difference of the gripper's width, m."""
    other: float = Field(default=1e-3, ge=0)
    """Difference of force (N), speed and waiting time (s)."""


class ReplayCameraConfig(Config):
    """A camera that replays the frames of a recording in order."""

    driver: Literal["replay"]
    recording: Path
    """File that hal.record wrote."""
    loop: bool = False
    """Restart after the last frame; otherwise a further capture is an error."""


class ReplayArmConfig(Config):
    """An arm that replays a recording to the same commands."""

    driver: Literal["replay"]
    recording: Path
    """File that hal.record wrote."""
    tolerances: Tolerances = Tolerances()
    """Greatest differences between a command and the recorded one."""


class ReplayCellConfig(Config):
    """A whole cell from one recording: camera, arm, table, feeder and tracker, synchronised."""

    type: Literal["replay"]
    recording: Path
    """File that hal.record wrote."""
    tolerances: Tolerances = Tolerances()
    """Greatest differences between a command and the recorded one."""


class RecordedCellConfig(Config):
    """Any other cell, whose calls are recorded."""

    type: Literal["recorded"]
    cell: Path
    """YAML file of the cell to record."""
    out: Path
    """The recording; must not exist yet."""
