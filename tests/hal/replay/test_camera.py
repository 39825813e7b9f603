"""A camera played back alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from hal.errors import CaptureFailed
from hal.replay import ReplayCamera, ReplayCameraConfig


def test_a_camera_plays_back_alone(recording: Path):
    camera = ReplayCamera(ReplayCameraConfig(driver="replay", recording=recording))
    with camera:
        assert [camera.capture().depth[1, 1] for _ in range(3)] == [1, 2, 3]
        with pytest.raises(CaptureFailed, match="no frame within 5 s"):
            camera.capture()
        assert camera.capture().depth[1, 1] == 5
        with pytest.raises(CaptureFailed, match="all 5 frames.*camera.loop"):
            camera.capture()


def test_a_camera_may_begin_again(recording: Path):
    with ReplayCamera(ReplayCameraConfig(driver="replay", recording=recording, loop=True)) as camera:
        seen = []
        for _ in range(11):
            try:
                seen.append(int(camera.capture().depth[1, 1]))
            except CaptureFailed:
                seen.append(0)
    assert seen == [1, 2, 3, 0, 5, 1, 2, 3, 0, 5, 1]
