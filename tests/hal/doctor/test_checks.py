"""The doctor's checks on inputs with a known fault."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from hal.camera_calibration import Calibration, write_calibration
from hal.doctor.checks import (
    check_calibration,
    check_drivers,
    check_motion,
    implausible,
)
from mskgrasp.core.geometry import Pose
from tests.hal.flat_table import DOWN, WORKSPACE
from tests.hal.franka.robots import arm_at, fci5
from tests.hal.replay.toy import ToyArm


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
