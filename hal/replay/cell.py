"""Cells that are recorded and cells that are replayed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from hal.cell import Cell
from hal.errors import NotRecorded
from hal.replay.arm import ReplayArm
from hal.replay.camera import ReplayCamera
from hal.replay.config import ReplayArmConfig, ReplayCameraConfig, ReplayCellConfig
from hal.replay.events import pose
from hal.replay.playback import Playback
from hal.replay.reader import read_recording
from hal.replay.recorder import RecordingArm, RecordingCamera, RecordingFeeder, RecordingTracker
from hal.replay.writer import RecordingWriter
from mskgrasp.core.geometry import Pose


def recorded_cell(cell: Cell, out: Path) -> Cell:
    """A cell, not connected yet, whose calls are recorded.

    Raises:
        UsageError: The file exists already.
    """
    writer = RecordingWriter(out, cell.workspace, cell.arm)
    return replace(
        cell,
        simulated=False,
        recorded=True,
        camera=RecordingCamera(cell.camera, writer),
        arm=RecordingArm(cell.arm, writer),
        feeder=None if cell.feeder is None else RecordingFeeder(cell.feeder, writer),
        tracker=None if cell.tracker is None else RecordingTracker(cell.tracker, writer),
    )


def replay_cell(config: ReplayCellConfig) -> Cell:
    """A cell that replays a recording to a program that gives the same commands.

    Raises:
        BadRecording: The file is missing, damaged or of another version.
    """
    recording = read_recording(config.recording)
    playback = Playback(recording, tolerances=config.tolerances)
    calls = {event.call for event in recording.events}
    return Cell(
        camera=ReplayCamera(ReplayCameraConfig(driver="replay", recording=config.recording), playback),
        arm=ReplayArm(ReplayArmConfig(driver="replay", recording=config.recording), playback),
        workspace=recording.workspace,
        feeder=ReplayFeeder(playback) if "present" in calls else None,
        tracker=ReplayTracker(playback) if "part_pose" in calls else None,
        recorded=True,
    )


class ReplayFeeder:
    """Feeder of a replay: the part is already in the recorded frames."""

    def __init__(self, playback: Playback):
        self._playback = playback

    def present(self, part: str, seed: int, *, keep: bool = False) -> None:
        """Check that it is the recorded part and seed.

        Raises:
            NotRecorded: It is not.
        """
        settings = {"keep": True} if keep else {}
        self._playback.command("present", {"part": part, "seed": seed} | settings)


class ReplayTracker:
    """Tracker that returns the poses recorded at this point."""

    def __init__(self, playback: Playback):
        self._playback = playback

    def part_pose(self) -> Pose:
        """``T_base_obj`` as recorded.

        Raises:
            NotRecorded: The recording holds no pose at this point.
        """
        event = self._playback.answer("part_pose")
        if event is None:
            raise NotRecorded(
                f"{self._playback.recording.path} holds no pose of the part at this point; the program does "
                "something else than when it was recorded"
            )
        return pose(event.result)
