"""Recordings of cells and cells that replay them, for debugging a run away from the cell."""

from hal.replay.arm import ReplayArm
from hal.replay.camera import ReplayCamera
from hal.replay.cell import recorded_cell, replay_cell
from hal.replay.config import RecordedCellConfig, ReplayArmConfig, ReplayCameraConfig, ReplayCellConfig
from hal.replay.reader import read_recording
from hal.replay.writer import RecordingWriter

__all__ = [
    "RecordedCellConfig", "RecordingWriter", "ReplayArm", "ReplayArmConfig", "ReplayCamera",
    "ReplayCameraConfig", "ReplayCellConfig", "read_recording", "recorded_cell", "replay_cell",
]  # fmt: skip
