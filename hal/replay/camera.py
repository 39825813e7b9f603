"""Camera that replays recorded frames."""

from __future__ import annotations

import time

from hal.camera import Camera, RgbdFrame
from hal.device import SharingDevice
from hal.errors import NotConnected
from hal.replay.config import ReplayCameraConfig
from hal.replay.playback import Playback
from hal.replay.reader import read_recording


class ReplayCamera(SharingDevice, Camera):
    """Camera that returns the recorded frames and errors one after the other.

    Args:
        config: Recording.
        playback: Shared with the arm of the same recording, so that both stay in step.

    Raises:
        BadRecording: The file is missing, damaged or of another version.
    """

    def __init__(self, config: ReplayCameraConfig, playback: Playback | None = None):
        self._resource = self._playback = playback or Playback(
            read_recording(config.recording), ("capture",), loop=config.loop
        )

    @property
    def by_hand(self) -> bool:
        """Whether the recorded camera's pose was measured by hand."""
        return self._playback.recording.by_hand

    def capture(self, timeout_s: float = 5.0) -> RgbdFrame:
        """The next recorded frame, at once; its time is that of this call, so that it counts as fresh.

        Raises:
            NotConnected: Outside the camera's context.
            CaptureFailed: It failed when recorded, or there are no frames left.
            NotRecorded: The program does something else than when it was recorded.
        """
        if not self._open:
            raise NotConnected("ReplayCamera is not connected; use it inside its context (with ...)")
        event = self._playback.command("capture", {})
        return self._playback.recording.frame(event.result, time.monotonic())
