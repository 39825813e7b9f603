"""What a cell's file says about recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from mskgrasp.core.config import Config


class Tolerances(Config):
    """How far a command may be from the recorded one and still count as the same."""

    position: float = Field(default=1e-3, ge=0)
    """Of the TCP, m."""
    rotation: float = Field(default=1e-2, ge=0)
    """Of the hand, rad."""
    joints: float = Field(default=5e-3, ge=0)
    """Of each joint, rad."""
    width: float = Field(default=5e-4, ge=0)
    """Of the gripper, m."""
    other: float = Field(default=1e-3, ge=0)
    """Of force (N), speed and waiting time (s)."""


class ReplayCameraConfig(Config):
    """A camera that plays back the frames of a recording, in their order."""

    driver: Literal["replay"]
    recording: Path
    """File that hal.record wrote."""
    loop: bool = False
    """After the last frame begin again; otherwise one more is an error."""


class ReplayArmConfig(Config):
    """An arm that answers as the recorded one did, as long as it is commanded the same."""

    driver: Literal["replay"]
    recording: Path
    """File that hal.record wrote."""
    tolerances: Tolerances = Tolerances()
    """How much the same."""


class ReplayCellConfig(Config):
    """A whole cell from one recording: camera, arm, table, feeder and tracker, in step with each other."""

    type: Literal["replay"]
    recording: Path
    """File that hal.record wrote."""
    tolerances: Tolerances = Tolerances()
    """How far a command may be from the recorded one."""


class RecordedCellConfig(Config):
    """Any other cell, with everything that happens on it written down."""

    type: Literal["recorded"]
    cell: Path
    """YAML file of the cell that is used."""
    out: Path
    """The recording; must not exist yet."""
