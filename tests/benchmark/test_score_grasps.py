"""Scores of grasps of a file in the isaac_grasp format."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from mskgrasp.benchmark.__main__ import main
from mskgrasp.benchmark.score_grasps import score
from mskgrasp.core.errors import UsageError
from mskgrasp.core.geometry import Pose
from mskgrasp.core.panda_kinematics import TCP_OFFSET
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts.store import read_record
from mskgrasp.planning.isaac_grasp import TopDownGrasp, write_isaac_grasp
from tests.boxes import make_box
from tests.planning.test_certified import PART, certified, certified_grasp
from tests.programs import run_here

FLAT = int(np.argmin(PART.resting.position[:, 2]))


def written(path, shift: np.ndarray):
    """A good grasp, the same turned by half a turn, one that misses the part, and one from the side."""
    theta = 0.1
    vectors = [(0.0, 0.0, 0.0105, theta), (0.0, 0.06, 0.0105, theta)]
    write_isaac_grasp(
        path,
        PART,
        certified(*(certified_grasp(resting=FLAT, grasp=np.array(one)) for one in vectors), like={}),
    )
    values = yaml.safe_load(path.read_text())
    good, miss = values["grasps"].values()
    grasps = {"good": good, "miss": miss}
    quat = Pose(
        position=np.zeros(3), quat_wxyz=np.array([good["orientation"]["w"], *good["orientation"]["xyz"]])
    )
    for name, turn in (("turned", [0.0, 0.0, 0.0, 1.0]), ("side", [np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0])):
        w, *xyz = map(float, (quat @ Pose(position=np.zeros(3), quat_wxyz=np.array(turn))).quat_wxyz)
        grasps[name] = good | {"orientation": dict(w=w, xyz=xyz)}
    grasps["side"] = grasps["side"] | {"position": [0.0, 0.5 * TCP_OFFSET, 0.3]}
    for one in grasps.values():
        one["position"] = (np.array(one["position"]) + shift).tolist()
    path.write_text(yaml.safe_dump(values | {"grasps": grasps}, sort_keys=False))


def test_top_down_grasps_get_confidence_displacement_and_covariance(tmp_path):
    path = tmp_path / "mine.yaml"
    written(path, np.array(read_record(PART.folder)["centroid_in_source"]))
    done = run_here(main, "--grasps", str(path), "--part", PART.name, "--out", str(tmp_path / "out"))
    assert done.returncode == 0, done.stderr
    assert "left out: side is tilted" in done.stderr and "scored 3 of 4 grasps" in done.stdout
    values = yaml.safe_load((tmp_path / "out" / "mine.scored.yaml").read_text())
    found = values["grasps"]
    assert list(found) == ["good", "miss", "turned"] and values["format"] == "isaac_grasp"
    assert found["good"]["confidence"] > 0.8 > 0.3 > found["miss"]["confidence"]
    covariance = np.array(found["good"]["displacement_cov"])
    assert covariance.shape == (4, 4) and (np.linalg.eigvalsh(covariance) > 0).all()
    # Half a turn of the hand is the same grasp, with its axes reversed.
    same = np.array(found["turned"]["displacement"]) * [-1, -1, 1, 1]
    assert same == pytest.approx(np.array(found["good"]["displacement"]), abs=1e-9)
    assert found["turned"]["confidence"] == found["good"]["confidence"]
    assert found["good"]["resting"] == found["turned"]["resting"]


def test_scores_are_written_beside_the_grasps_where_no_folder_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine").mkdir()
    path = tmp_path / "mine" / "grasps.yaml"
    written(path, np.array(read_record(PART.folder)["centroid_in_source"]))
    done = run_here(main, "--grasps", str(path), "--part", PART.name)
    assert done.returncode == 0, done.stderr
    assert {one.name for one in path.parent.iterdir()} == {"grasps.yaml", "grasps.scored.yaml"}
    assert not (tmp_path / "out").exists()  # where a benchmark without --out is refused beside other files


def test_a_named_folder_is_used_and_a_name_does_not_control_the_terminal(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "grasps.yaml"
    written(path, np.array(read_record(PART.folder)["centroid_in_source"]))
    values = yaml.safe_load(path.read_text())
    path.write_text(yaml.safe_dump(values | {"grasps": {"\x1b[2Jgood": values["grasps"]["good"]}}))
    out = Path("out/benchmark")  # which is the default of a benchmark without --grasps
    done = run_here(main, "--grasps", str(path), "--part", PART.name, "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert "  \\x1b[2Jgood: quality" in done.stdout and "\x1b" not in done.stdout
    assert [one.name for one in out.iterdir()] == ["grasps.scored.yaml"]


def test_grasps_of_a_pose_that_the_camera_does_not_see_are_left_out(tmp_path, capsys):
    part = make_box(tmp_path, "sheet", (0.06, 0.03, 0.0015), 0.02)
    poses = np.argsort(part.resting.position[:, 2])
    grasp = np.array([0.0, 0.0, 0.0105, 0.0])
    grasps = {
        name: TopDownGrasp(resting=int(pose), grasp=grasp, sign=1.0, tilt=0.0)
        for name, pose in (("flat", poses[0]), ("upright", poses[-1]))
    }
    assert score(part, load_models(), grasps) == {}
    said = capsys.readouterr().err
    for name, one in grasps.items():
        assert f"left out: {name}: in pose {one.resting} the camera does not see the part" in said


def test_grasps_need_their_part(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.argv", ["benchmark", "--grasps", str(tmp_path / "mine.yaml")])
    with pytest.raises(UsageError, match="--grasps needs --part"):
        main()
