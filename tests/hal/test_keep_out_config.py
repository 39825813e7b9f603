"""Keep-outs in files of cells, real and simulated."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from hal import Cell, cell_from_yaml
from hal.keep_out import Box, Capsule
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.shipped import config_file
from tests.hal.real_cell import measured_cell

POST = dict(shape="capsule", name="post", ends=[[0.2, 0.5, 0.0], [0.2, 0.5, 1.2]], radius=0.03)
SHELF = dict(shape="box", name="shelf", lower=[-0.6, -0.8, 0.0], upper=[0.4, -0.6, 0.4])
LAMP = dict(shape="sphere", name="lamp", centre=[0.5, 0.5, 0.9], radius=0.1)
KINDS = ("sapien", "mujoco", "real")


def cell_with(folder: Path, kind: str, keep_out: Any) -> Cell:
    source = measured_cell(folder) if kind == "real" else config_file(f"cells/{kind}.yaml")
    values = yaml.safe_load(source.read_text(encoding="utf-8"))
    (values["workspace"] if kind == "real" else values)["keep_out"] = keep_out
    path = folder / "kept.yaml"
    path.write_text(yaml.safe_dump(values), encoding="utf-8")
    return cell_from_yaml(path)


@pytest.mark.parametrize("kind", KINDS)
def test_shapes_of_a_file_are_kept_out_of(tmp_path: Path, kind: str):
    shapes = cell_with(tmp_path, kind, [POST, SHELF, LAMP]).arm.limits.keep_out
    post, shelf, lamp = shapes[-3:]
    assert isinstance(post, Capsule) and post.radius == 0.03 and post.ends.tolist() == POST["ends"]
    assert isinstance(shelf, Box) and shelf.upper.tolist() == SHELF["upper"]
    assert isinstance(lamp, Capsule) and (lamp.ends[0] == lamp.ends[1]).all()


def test_a_camera_whose_pose_is_known_makes_its_own(tmp_path: Path):
    (camera,) = cell_from_yaml(config_file("cells/sapien.yaml")).arm.limits.keep_out
    assert camera.name == "camera" and isinstance(camera, Capsule)
    assert camera.ends.mean(axis=0)[:2] == pytest.approx([0.5, 0.0])
    path = measured_cell(tmp_path)
    assert cell_from_yaml(path).arm.limits.keep_out == ()  # not calibrated yet
    (tmp_path / "kinect2.yaml").write_text(
        "schema_version: 1\nserial: '1'\n"
        "T_base_camera: {position_m: [0.5, 0.0, 0.9], quat_wxyz: [0.0, 1.0, 0.0, 0.0]}\n"
        "rms_translation_m: 0.001\nrms_rotation_rad: 0.001\nn_poses: 20\n"
        "intrinsics: null\nmade: '2026-11-24T10:00:00'\n"
    )
    (camera,) = cell_from_yaml(path).arm.limits.keep_out
    assert camera.name == "camera" and isinstance(camera, Capsule) and np.all(camera.ends[:, 2] > 0.9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("keep_out", "message"),
    [
        ([LAMP | dict(centre=[0.3, 0.0, 0.7])], "mm into 'lamp'"),
        ([LAMP | dict(radius=float("nan"))], "should be a finite number, got nan"),
        ([LAMP | dict(radius=-0.1)], "greater than 0, got -0.1"),
        ([dict(shape="cone")], "unknown shape 'cone'; legal: sphere, capsule, box"),
        ([dict(name="post")], "shape is missing; legal: sphere, capsule, box"),
        ([SHELF | dict(upper=[-0.7, 0.0, 1.0])], "must be below upper"),
        ([POST | dict(ends=[[0.2, 0.5, float("inf")], [0, 0, 0]])], "should be a finite number, got inf"),
        ([LAMP | dict(center=[0, 0, 0])], "unknown key"),
        ("post", "got 'post'"),
    ],
)
def test_a_wrong_shape_is_one_line_that_names_it(tmp_path: Path, kind: str, keep_out: Any, message: str):
    with pytest.raises(BadConfig) as caught:
        cell_with(tmp_path, kind, keep_out)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value) and caught.value.exit_code == 2


def test_a_keep_out_in_the_region_is_refused_on_a_real_cell(tmp_path: Path):
    crate = dict(shape="box", name="crate", lower=[0.36, -0.15, 0.0], upper=[0.4, -0.1, 0.3])
    with pytest.raises(BadConfig, match=r"cannot be grasped everywhere.*'crate'"):
        cell_with(tmp_path, "real", [crate])
