"""The doctor's checks on inputs with a known fault."""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path

import numpy as np
import pytest

from hal import Camera, RgbdFrame
from hal.camera_calibration import Calibration, write_calibration
from hal.doctor.checks import (
    check_calibration,
    check_drivers,
    check_motion,
    check_stream,
    check_table,
    check_view,
    implausible,
)
from hal.errors import CaptureFailed
from mskgrasp.core.geometry import Pose
from tests.hal.flat_table import DOWN, WORKSPACE, frame_of_table
from tests.hal.franka.robots import arm_at, fci5
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


@pytest.mark.parametrize(
    ("position", "quat_wxyz", "words"),
    [
        ([0.5, 0, 0.8], [1, 0, 0, 0], "look down"),
        ([0.5, 0, 8.0], DOWN.quat_wxyz, "8.00 m over the table"),
        ([0.5, 0, -0.8], DOWN.quat_wxyz, "over the table"),
        ([-0.5, 0, 0.8], DOWN.quat_wxyz, "beside the region"),
    ],
)
def test_a_camera_that_cannot_be_there_is_found(position, quat_wxyz, words):
    pose = Pose(position=np.array(position), quat_wxyz=np.array(quat_wxyz, dtype=float))
    assert words in implausible(pose, WORKSPACE)
    assert not implausible(DOWN, WORKSPACE)


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


def calibration(**changes: object) -> Calibration:
    good = Calibration(
        serial="a", T_base_camera=DOWN, intrinsics=None, rms_translation_m=5e-4, rms_rotation_rad=2e-3,
        n_poses=24, made="2026-11-21T12:00:00+00:00",
    )  # fmt: skip
    return dataclasses.replace(good, **changes)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("changes", "level", "words"),
    [
        ({}, "ok", "24 poses"),
        (dict(n_poses=0), "warn", "measured by hand, good to centimetres, and no grasp is executed"),
        (dict(n_poses=9), "warn", "few poses"),
        (dict(rms_translation_m=0.02), "warn", "large residuals"),
        (dict(serial="b"), "fail", "camera b, not of camera a"),
        (dict(T_base_camera=Pose.identity()), "fail", "over the table"),
    ],
)
def test_a_calibration_file_is_judged(tmp_path: Path, changes: dict, level: str, words: str):
    write_calibration(tmp_path / "camera.yaml", calibration(**changes))
    values = dict(camera=dict(driver="kinect2", calibration="camera.yaml", serial="a"))
    finding = check_calibration(values, tmp_path / "cell.yaml", WORKSPACE)
    assert finding is not None and finding.level == level and words in finding.text


def test_a_missing_calibration_file_is_looked_for_beside_the_cell_file(tmp_path: Path):
    values = dict(camera=dict(driver="kinect2", calibration="camera.yaml"))
    finding = check_calibration(values, tmp_path / "cell.yaml", WORKSPACE)
    assert finding is not None and finding.level == "fail" and str(tmp_path / "camera.yaml") in finding.text


def test_a_wheel_for_another_robot_is_found():
    both = [dict(driver="franky", robot="panda"), dict(driver="panda_py", robot="fr3")]
    for arm in both:
        (finding,) = check_drivers(dict(type="devices", arm=arm, camera=dict(driver="replay")))
        assert finding.level in ("warn", "fail") and str(arm["driver"]) in finding.subject


def test_a_part_in_the_hand_is_not_dropped(tmp_path: Path):
    """An earlier program grasped it; what the hand itself reports tells."""
    with fci5() as robot:
        robot.order("part 0.03")
        with arm_at(tmp_path, "panda_py", robot.host) as arm:
            assert arm.grasp(20.0).holding
        with arm_at(tmp_path, "panda_py", robot.host) as arm:
            (finding,) = check_motion(arm)
            assert finding.level == "fail" and "run python -m hal.home" in finding.text
            assert arm.in_hand() is not None
            robot.order("part 0")
            arm.open_gripper()
            assert [finding.level for finding in check_motion(arm)] == ["ok", "ok"]


@pytest.mark.parametrize("widest", [0.0803, 0.0791])
def test_a_hand_that_opens_by_some_tenths_more_or_less_than_its_datasheet_is_no_fault(
    monkeypatch: pytest.MonkeyPatch, widest: float
):
    arm = ToyArm()
    state = arm._state
    monkeypatch.setattr(arm, "_known_width", lambda: widest)
    monkeypatch.setattr(arm, "_state", lambda: dataclasses.replace(state(), max_width=widest))
    with arm:
        _, hand = check_motion(arm)
    assert hand.level == "ok" and f"{1e3 * widest:.1f} mm: within 0.00 mm" in hand.text
