"""Cells that are put together from an arm and a camera: what their file may say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from hal import cell_from_yaml
from hal.franka import FrankaArm, PandaPyArmConfig
from mskgrasp.core.config import check_config, read_yaml
from mskgrasp.core.errors import BadConfig
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
        ({"arm": {"driver": None}}, "'arm.driver' is None; legal: franky"),
        ({"camera": {"driver": "webcam"}}, "'camera.driver' is 'webcam'; legal: "),
        ({"arm": {"max_sped": 1}}, "unknown key 'max_sped'; legal keys here: acceleration"),
        ({"arm": {"max_speed": 3.0}}, "arm: 'max_speed': input should be less than or equal to 1"),
        ({"arm": {"max_grasp_force": 200}}, "'max_grasp_force': input should be less than or equal to 70"),
        ({"arm": {"host": ""}}, "'host': string should have at least 1 character"),
        ({"workspace": {"grasp_force": 60}}, "grasp_force 60 N is over the arm's 40 N (arm.max_grasp_force)"),
        ({"workspace": {"region": [0.6, 0.74, -0.39, 0.39]}}, "cannot be grasped everywhere"),
        ({"workspace": {"region": [0.38, 0.9, -0.1, 0.1]}}, "reaches out of the box"),
        ({"workspace": {"home": [0, 0, 0, 0.5, 0, 1.5, 0]}}, "home puts joint 4 at 0.500 rad, outside"),
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


def test_the_documented_cell_is_slower_and_gentler_than_the_defaults():
    values = read_yaml(CELLS / "panda_kinect2.yaml")
    arm, default = (
        check_config(PandaPyArmConfig, values["arm"], "x"),
        PandaPyArmConfig(driver="panda_py", host="x"),
    )
    assert arm.max_speed <= default.max_speed and arm.contact_force <= default.contact_force
    assert values["workspace"]["grasp_force"] <= arm.max_grasp_force
