"""The doctor's checks of a camera on inputs with a known fault."""

from __future__ import annotations

import dataclasses
import time

import numpy as np
import pytest

from hal import Camera, RgbdFrame
from hal.doctor.camera_checks import check_sight, check_stream, check_table, check_view
from hal.errors import CaptureFailed
from mskgrasp.core.panda_body import PANDA_LINKS
from tests.hal.flat_table import WORKSPACE, frame_of_table
from tests.hal.replay.toy import ToyArm


@pytest.mark.parametrize(
    ("z", "slope", "level", "words"),
    [
        (0.001, 0.0, "ok", "+1.0 mm"),
        (0.004, 0.0, "fail", "programs refuse a table seen more than 2 mm higher"),
        (-0.004, 0.0, "warn", "warm up"),
        (-0.024, 0.0, "fail", "add -0.0240 to camera.depth_offset (the camera measures too far)"),
        (0.0, 0.03, "fail", "tilted by 1.72 degrees"),
    ],
)
def test_a_table_elsewhere_is_found_with_its_remedy(z: float, slope: float, level: str, words: str):
    depth, table = check_table(frame_of_table(z, slope), WORKSPACE)
    assert depth.level == "ok" and table.level == level and words in table.text


def test_a_tilt_that_the_file_states_is_no_fault():
    stated = dataclasses.replace(WORKSPACE, table_slope=(0.03, 0.0))
    _, table = check_table(frame_of_table(0.001, 0.03), stated)
    assert table.level == "ok" and "tilted by 0.00 degrees" in table.text


@pytest.mark.parametrize(
    ("rows", "level", "share"), [(20, "ok", "100%"), (80, "warn", "50%"), (100, "fail", "32%")]
)
def test_missing_depth_is_found(rows: int, level: str, share: str):
    """The region is rows 25 to 134 of the image, which is blind from the top to one of them."""
    frame = frame_of_table()
    frame.depth[:rows] = np.nan
    depth = next(check_table(frame, WORKSPACE))
    assert depth.level == level and depth.text.startswith(f"{share} of the region has a depth")


def test_a_region_out_of_the_image_is_found():
    wide = dataclasses.replace(WORKSPACE, region=(0.3, 0.7, -0.2, 0.2))
    assert [f.level for f in check_view(frame_of_table(), WORKSPACE)] == ["ok"]
    (finding,) = check_view(frame_of_table(), wide)
    assert finding.level == "fail" and "out of the image" in finding.text


def test_a_region_that_leaves_the_image_at_the_height_of_a_lift_is_found():
    """At 0.8 m the image shows 0.35 m of the table, 0.1 m higher 0.31 m."""
    wide = dataclasses.replace(WORKSPACE, region=(0.335, 0.665, -0.12, 0.12))
    (finding,) = check_view(frame_of_table(), wide)
    assert finding.level == "fail" and "up to the 100 mm of a lift, reaches 7 pixels out" in finding.text
    low = dataclasses.replace(wide, lift_height=0.01)
    assert [f.level for f in check_view(frame_of_table(), low)] == ["ok"]


class Frames(Camera):
    """Delivers frames with the given time stamps."""

    def __init__(self, stamps: list[float]):
        self.stamps = stamps

    def connect(self) -> None: ...

    def close(self) -> None: ...

    def capture(self, timeout_s: float = 5.0) -> RgbdFrame:
        if not self.stamps:
            raise CaptureFailed("no frame came within 5 s; plug it in")
        return dataclasses.replace(frame_of_table(), timestamp_s=time.monotonic() - self.stamps.pop(0))


@pytest.mark.parametrize(
    ("ages", "level", "words"),
    [
        ([0.0] * 11, "ok", "frames/s"),
        ([2.0] * 11, "warn", "slow"),
        ([0.0, 0.0, 0.1] + [0.0] * 8, "fail", "the same exposure twice"),
        ([0.0, 0.0], "fail", "plug it in"),
    ],
)
def test_stale_repeated_and_missing_frames_are_found(monkeypatch, ages, level, words):
    """30 ms from frame to frame, however busy the machine is."""
    clock = iter(np.arange(0.0, 100.0, 0.01))
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    (finding,) = check_stream(Frames(list(ages)), [])
    assert finding.level == level and words in finding.text


@pytest.mark.parametrize(("n", "level"), [(1, "warn"), (9, "ok")])
def test_several_exposures_may_take_their_time(monkeypatch, n: int, level: str):
    """0.2 s each, 0.6 s old: too slow and too old for one exposure, not for the median of nine."""
    clock = iter(np.arange(0.0, 100.0, 0.1))
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    camera = Frames([0.6] * 11)
    monkeypatch.setattr(Frames, "exposures", n)
    (finding,) = check_stream(camera, [])
    assert finding.level == level and ("median of 9 exposures" in finding.text) == (n == 9)


def test_an_arm_over_the_region_is_found_before_it_is_taken_for_the_table(monkeypatch):
    arm = ToyArm()
    monkeypatch.setattr(ToyArm, "links", PANDA_LINKS)
    arm.connect()
    stretched = np.array([0.0, 0.0, 0.0, -2.0, 0.0, 1.9, 0.785])
    for home, words in (
        (stretched, "choose other joints for workspace.home"),
        (WORKSPACE.home, "move the arm"),
    ):
        state = dataclasses.replace(arm.state(), joints=stretched)
        monkeypatch.setattr(arm, "state", lambda state=state: state)
        workspace = dataclasses.replace(WORKSPACE, home=np.array(home))
        (finding,) = check_sight(frame_of_table(), arm, workspace)
        assert finding.level == "fail" and words in finding.text
