"""ManiSkill's trajectory format: read by its own loader, its numbers by hand."""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from mani_skill.trajectory.dataset import ManiSkillTrajectoryDataset

from mskgrasp.core.geometry import Pose
from tasks.trajectories import Episode, camera_parameters, write_trajectories
from tests.synthetic import INTRINSICS, OVERHEAD, TILTED


def episode(number: int, *, success: bool) -> Episode:
    before = np.array([0.5 + 0.01 * number, 0.1, 0.02, 1, 0, 0, 0])
    after = np.array([0.5, 0.1, 0.12, 0, 0, 0, 1]) if success else np.full(7, np.nan)
    return Episode(
        part=f"part_{number}",
        grasp=np.array([0.5, 0.1, 0.02, 0.3 * number]),
        depth=np.full((6, 8), 0.7 + 0.01 * number, np.float32),
        T_base_obj=np.stack([before, after]),
        success=success,
        info={"failure": "none" if success else "missed"},
    )


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("trajectories") / "data.h5"
    episodes = (episode(number, success=number != 1) for number in range(3))
    n = write_trajectories(
        path, episodes, env_kwargs=dict(control_mode="grasp"), intrinsics=INTRINSICS, T_base_camera=OVERHEAD,
        description="made by hand",
    )  # fmt: skip
    assert n == 3
    return path


def test_a_full_disk_is_an_error_with_the_files_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("mskgrasp.core.files.LEAST_FREE", 2**62)  # more than any disk has
    with pytest.raises(OSError, match="No space left on device") as raised:
        write_trajectories(
            tmp_path / "data.h5", [episode(0, success=True)], env_kwargs={}, intrinsics=INTRINSICS,
            T_base_camera=OVERHEAD, description="made by hand",
        )  # fmt: skip
    assert raised.value.filename == str(tmp_path / "data.h5")


def test_maniskills_loader_reads_what_was_written(written: Path):
    data = ManiSkillTrajectoryDataset(str(written))
    assert len(data) == 3
    expected = [[0.5, 0.1, 0.02, 0.3 * number] for number in range(3)]
    assert np.asarray(data.actions) == pytest.approx(np.array(expected))
    assert data.success.tolist() == [True, False, True] and data.fail.tolist() == [False, True, False]
    assert data.rewards.tolist() == [1, 0, 1]
    assert data.terminated.all() and not data.truncated.any()
    depth = data.obs["sensor_data"]["overhead"]["depth"]
    assert depth.shape == (3, 6, 8, 1) and depth[:, 0, 0, 0] == pytest.approx([0.7, 0.71, 0.72])
    assert data.env_kwargs == {"control_mode": "grasp"}


def test_an_episode_is_one_step_with_an_observation_on_either_side(written: Path):
    with h5py.File(written) as file:
        assert sorted(file) == ["traj_0", "traj_1", "traj_2"]
        won, lost = file["traj_2"], file["traj_1"]
        assert won["actions"].shape == (1, 4) and won["env_states/actors/part"].shape == (2, 13)
        # ManiSkill's world has the robot's base at x = -0.615 m.
        state = won["env_states/actors/part"][:]
        assert state[0] == pytest.approx([0.52 - 0.615, 0.1, 0.02, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0], abs=1e-6)
        assert state[1, :7] == pytest.approx([0.5 - 0.615, 0.1, 0.12, 0, 0, 0, 1], abs=1e-6)
        assert won["obs/extra/part_pose"][1] == pytest.approx([0.5, 0.1, 0.12, 0, 0, 0, 1], abs=1e-6)
        assert np.isnan(lost["obs/extra/part_pose"][1]).all()
        assert np.isfinite(lost["obs/extra/part_pose"][0]).all()


def test_the_record_beside_it_rebuilds_each_episode(written: Path):
    record = json.loads(written.with_suffix(".json").read_text())
    assert record["env_info"]["env_id"] == "GraspDisplacement-v1"
    assert record["source_desc"] == "made by hand"
    one = record["episodes"][1]
    assert (one["episode_id"], one["control_mode"], one["success"], one["fail"]) == (1, "grasp", False, True)
    assert one["reset_kwargs"]["options"] == {
        "parts": ["part_1"], "reconfigure": True, "pose_base_obj": [[0.51, 0.1, 0.02, 1, 0, 0, 0]],
    }  # fmt: skip
    assert one["info"] == {"failure": "missed"}


@pytest.mark.parametrize("camera", [OVERHEAD, TILTED], ids=["overhead", "tilted"])
def test_a_point_is_seen_at_the_same_place_in_both_conventions(camera: Pose):
    """A pixel's corner instead of its centre at integers; OpenGL's camera looks along -z, its y up."""
    found = camera_parameters(INTRINSICS, camera)
    assert {value.dtype for value in found.values()} == {np.dtype(np.float32)}
    for point in np.random.default_rng(0).uniform([0.3, -0.2, 0], [0.6, 0.2, 0.1], (10, 3)):
        ours = camera.inverse().apply(point)
        world = np.append(point + [-0.615, 0, 0], 1)
        theirs = found["extrinsic_cv"] @ world
        assert theirs == pytest.approx(ours, abs=1e-6)
        pixel, other = INTRINSICS @ ours, found["intrinsic_cv"] @ theirs
        assert other[:2] / other[2] == pytest.approx(pixel[:2] / pixel[2] + 0.5, abs=1e-3)
        opengl = np.linalg.inv(found["cam2world_gl"]) @ world
        assert opengl == pytest.approx([ours[0], -ours[1], -ours[2], 1], abs=1e-5)
