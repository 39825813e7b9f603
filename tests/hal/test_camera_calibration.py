"""The calibration file: what is written is read, and nothing else."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hal.camera_calibration import Calibration, read_calibration, write_calibration
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.geometry import Pose

OVERHEAD = Calibration(
    serial="012345678901",
    T_base_camera=Pose(position=np.array([0.5, 0.0, 1.0]), quat_wxyz=np.array([0.0, 0.6, -0.8, 0.0])),
    intrinsics=np.array([[365.5, 0, 255.5], [0, 365.5, 211.5], [0, 0, 1.0]]),
    rms_translation_m=4e-4,
    rms_rotation_rad=1e-3,
    n_poses=24,
    made="2026-11-21T12:00:00+00:00",
)


def edited(path: Path, **changes: object) -> Path:
    """A good file with some of its top-level values changed; None removes nothing, it is written as null."""
    write_calibration(path, OVERHEAD)
    values = yaml.safe_load(path.read_text())
    path.write_text(yaml.safe_dump({**values, **changes}))
    return path


@settings(deadline=None, max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    position=arrays(np.float64, 3, elements=st.floats(-5, 5)),
    turn=arrays(np.float64, 4, elements=st.floats(-1, 1)).filter(lambda q: np.linalg.norm(q) > 0.1),
)
def test_every_pose_survives_the_file(tmp_path: Path, position: np.ndarray, turn: np.ndarray):
    pose = Pose(position=position, quat_wxyz=turn / np.linalg.norm(turn))
    written = dataclasses.replace(OVERHEAD, T_base_camera=pose)
    write_calibration(tmp_path / "camera.yaml", written)
    read = read_calibration(tmp_path / "camera.yaml", serial="012345678901")
    assert read.T_base_camera.as_matrix() == pytest.approx(pose.as_matrix(), abs=1e-12)
    assert read.intrinsics == pytest.approx(OVERHEAD.intrinsics)
    assert (read.serial, read.n_poses, read.made) == (OVERHEAD.serial, 24, OVERHEAD.made)
    assert (read.rms_translation_m, read.rms_rotation_rad) == (4e-4, 1e-3)


def test_the_factorys_intrinsics_are_none(tmp_path: Path):
    write_calibration(tmp_path / "c.yaml", dataclasses.replace(OVERHEAD, intrinsics=None))
    assert read_calibration(tmp_path / "c.yaml", serial=None).intrinsics is None


def test_the_file_says_its_units_and_conventions(tmp_path: Path):
    write_calibration(tmp_path / "c.yaml", OVERHEAD)
    text = (tmp_path / "c.yaml").read_text()
    for word in ("position_m", "quat_wxyz", "Metres", "optical frame"):
        assert word in text


def test_another_cameras_file_is_refused_and_both_serials_are_named(tmp_path: Path):
    with pytest.raises(BadConfig, match="camera 012345678901, not of camera 999"):
        read_calibration(edited(tmp_path / "c.yaml"), serial="999")
    assert read_calibration(tmp_path / "c.yaml", serial=None).serial == "012345678901"


def test_a_place_measured_by_hand_serves_any_camera_and_says_what_it_is(tmp_path: Path):
    assert read_calibration(edited(tmp_path / "c.yaml", n_poses=0), serial="999").by_hand


def test_a_missing_file_says_how_it_is_made(tmp_path: Path):
    with pytest.raises(
        BadConfig, match=r"no calibration file .*none.yaml; make it with python -m hal.calibrate"
    ):
        read_calibration(tmp_path / "none.yaml", serial=None)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(T_base_camera=dict(position_m=[0, 0, 1], quat_wxyz=[1, 1, 0, 0])), "no rotation"),
        (dict(T_base_camera=dict(position_m=[0, 0, 1], quat_wxyz=[0, 0, 0, 0])), "no rotation"),
        (dict(T_base_camera=dict(position_m=[0, 0, float("nan")], quat_wxyz=[1, 0, 0, 0])), "finite"),
        (dict(T_base_camera=dict(position_m=[0, 0, 1], quat_xyzw=[0, 0, 0, 1])), "quat_xyzw"),
        (dict(serial=12345), "'serial' must be in quotes"),
        (dict(intrinsics=[[365, 1, 255], [0, 365, 211], [0, 0, 1]]), "no pinhole matrix"),
        (dict(intrinsics=[[-365, 0, 255], [0, 365, 211], [0, 0, 1]]), "no pinhole matrix"),
        (dict(schema_version=2), "schema_version"),
        (dict(n_poses=-1), "n_poses"),
        (dict(colour="red"), "unknown key 'colour'"),
    ],
)
def test_a_wrong_file_is_one_line_that_names_it(tmp_path: Path, changes: dict, message: str):
    path = edited(tmp_path / "c.yaml", **changes)
    with pytest.raises(BadConfig) as caught:
        read_calibration(path, serial=None)
    assert message in str(caught.value) and str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_nothing_that_cannot_be_read_is_written(tmp_path: Path):
    broken = dataclasses.replace(
        OVERHEAD, T_base_camera=Pose(position=np.full(3, np.nan), quat_wxyz=np.array([1.0, 0, 0, 0]))
    )
    with pytest.raises(BadConfig):
        write_calibration(tmp_path / "c.yaml", broken)
    assert not list(tmp_path.iterdir())
