"""Cells that are put together from an arm and a camera: what their file may say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from hal import cell_from_yaml
from hal.errors import OutOfWorkspace
from hal.franka import FrankaArm, PandaPyArmConfig
from mskgrasp.core.config import check_config, read_yaml
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.grasp import pose_base_tcp
from tests.hal.real_cell import measured_cell
from tests.hal_contract.conftest import CELLS

GOOD: dict[str, Any] = {
    "type": "devices",
    "arm": {"driver": "panda_py", "host": "127.0.0.250"},
    "camera": {"driver": "sapien"},
    "workspace": {"table_z": 0.0},
}


def write(path: Path, **changes: dict[str, Any]) -> Path:
    values = {
        key: {**value, **changes.get(key, {})} if isinstance(value, dict) else value
        for key, value in GOOD.items()
    }
    path.write_text(yaml.safe_dump(values))
    return path


def test_a_cell_is_built_without_connecting(tmp_path: Path):
    cell = cell_from_yaml(write(tmp_path / "cell.yaml", workspace={"table_z": 0.02}))
    assert isinstance(cell.arm, FrankaArm)
    assert cell.arm.limits.table_z == cell.workspace.table_z == 0.02
    assert cell.arm.limits.box_lower[2] == 0.02


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"arm": {"driver": "ur5"}}, "'arm.driver' is 'ur5'; legal: franky, panda_py"),
        ({"arm": {"driver": None}}, "'arm.driver' is missing; legal: franky"),
        ({"camera": {"driver": "webcam"}}, "'camera.driver' is 'webcam'; legal: "),
        ({"arm": {"max_sped": 1}}, "unknown key 'max_sped'; legal keys here: acceleration"),
        ({"arm": {"max_speed": 3.0}}, "arm: 'max_speed': input should be less than or equal to 1"),
        ({"arm": {"max_grasp_force": 200}}, "'max_grasp_force': input should be less than or equal to 70"),
        ({"arm": {"host": ""}}, "'host': string should have at least 1 character"),
        ({"workspace": {"grasp_force": 60}}, "grasp_force 60 N is outside 0 .. 30 N"),
        ({"workspace": {"region": [0.6, 0.74, -0.39, 0.39]}}, "cannot be grasped everywhere"),
        ({"workspace": {"region": [0.38, 0.9, -0.1, 0.1]}}, "reaches out of the box"),
        ({"workspace": {"home": [0, 0, 0, 0.5, 0, 1.5, 0]}}, "refused: joint 4 to 0.500 rad is outside"),
        ({"workspace": {"home": [1.57, -0.8, 0, -2.4, 0, 1.6, 0.8]}}, "refused: TCP target (0.000, 0.305,"),
        ({"workspace": {"home": [0, 0, 0]}}, "home has 3 joints, the arm has 7"),
        ({"workspace": {"table_z": "low"}}, "'workspace.table_z': input should be a valid number"),
        ({"workspace": {"box_upper": [0.2, 0.4, 0.7]}}, "must be below box_upper"),
        ({"workspace": {"tabel_z": 0.1}}, "unknown key 'workspace.tabel_z'"),
    ],
)  # fmt: skip
def test_a_wrong_file_is_one_line_that_names_it(tmp_path: Path, changes: dict[str, Any], message: str):
    path = write(tmp_path / "cell.yaml", **changes)
    with pytest.raises(BadConfig) as caught:
        cell_from_yaml(path)
    assert message in str(caught.value) and str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_table_of_unknown_height_is_asked_for(tmp_path: Path):
    path = tmp_path / "cell.yaml"
    path.write_text(yaml.safe_dump({**GOOD, "workspace": {}}))
    with pytest.raises(BadConfig, match=r"'workspace\.table_z': field required"):
        cell_from_yaml(path)


def test_the_documented_cell_is_refused_until_its_table_is_measured(tmp_path: Path):
    with pytest.raises(BadConfig, match=r"'workspace\.table_z': .*run hal\.touch") as caught:
        cell_from_yaml(CELLS / "panda_kinect2.yaml")
    assert "\n" not in str(caught.value)
    cell = cell_from_yaml(measured_cell(tmp_path))
    assert cell.workspace.clearance == cell.arm.limits.clearance == 0.003


def test_a_slope_of_the_table_reaches_arm_and_planner(tmp_path: Path):
    path = write(tmp_path / "cell.yaml", workspace={"table_z": 0.01, "table_slope": [0.01, 0.0]})
    cell = cell_from_yaml(path)
    high, low = (float(cell.workspace.lowest_grasp_z(np.array([x, 0.0]))) for x in (0.62, 0.38))
    assert high - low == pytest.approx(0.0024)
    cell.arm.check_pose(pose_base_tcp(np.array([0.62, 0.0, high, 0.0])))
    cell.arm.check_pose(pose_base_tcp(np.array([0.38, 0.0, low, 0.0])))
    with pytest.raises(OutOfWorkspace, match="over the table"):
        cell.arm.check_pose(pose_base_tcp(np.array([0.62, 0.0, low, 0.0])))


def test_an_arm_of_which_the_file_says_little_is_as_cautious_as_the_shipped_one():
    values = read_yaml(CELLS / "panda_kinect2.yaml")
    shipped = check_config(PandaPyArmConfig, values["arm"], "x")
    assert PandaPyArmConfig(driver="panda_py", host=shipped.host) == shipped
    assert values["workspace"]["grasp_force"] <= shipped.max_grasp_force
