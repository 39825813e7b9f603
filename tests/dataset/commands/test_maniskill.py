"""Datasets as ManiSkill trajectories."""

from __future__ import annotations

import json
import logging
from pathlib import Path

import gymnasium
import h5py
import numpy as np
import pytest
import torch
from mani_skill.trajectory.dataset import ManiSkillTrajectoryDataset
from mani_skill.trajectory.utils import index_dict
from mani_skill.utils.wrappers.record import RecordEpisode

import tasks  # noqa: F401 (registers the task)
from mskgrasp.core.grasp import FAILURES
from mskgrasp.core.settings import Physics
from mskgrasp.dataset import list_shards, read_shard, u16_to_depth
from mskgrasp.dataset.commands.command_line import main
from mskgrasp.dataset.commands.maniskill import export_maniskill
from tests import synthetic


@pytest.fixture(scope="module")
def trajectories(collected: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("export") / "data.h5"
    assert main(["export", str(collected), "--format", "maniskill", "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def recorded(collected: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first attempt, made again in the task while ManiSkill records it."""
    attempts, info = read_shard(list_shards(collected)[0])
    folder = tmp_path_factory.mktemp("recorded")
    logging.getLogger("mani_skill").setLevel(logging.ERROR)
    env = gymnasium.make("GraspDisplacement-v1", parts=[info.part], obs_mode="depth", control_mode="grasp")
    env = RecordEpisode(env, str(folder), trajectory_name="recorded", save_video=False)
    env.reset(seed=0, options=dict(pose_base_obj=attempts.pose_base_obj[:1]))
    env.step(attempts.grasp[:1])
    env.close()
    return folder / "recorded.h5"


def layout(group: h5py.Group) -> dict[str, tuple]:
    found: dict[str, tuple] = {}
    group.visititems(
        lambda name, item: found.update({name: (item.dtype, item.shape)}) if hasattr(item, "dtype") else None
    )
    return found


def test_maniskills_own_loader_reads_the_trajectories(trajectories, joined, capsys):
    data = ManiSkillTrajectoryDataset(str(trajectories))
    assert len(data) == 12
    assert np.array_equal(data.actions, joined.grasp)
    assert np.array_equal(data.success, joined.success) and np.array_equal(data.fail, ~joined.success)
    depth = data.obs["sensor_data"]["overhead"]["depth"]
    assert np.array_equal(depth[..., 0], np.nan_to_num(u16_to_depth(joined.depth)))
    assert np.array_equal(data.rewards, joined.success.astype(np.float32))
    assert data.env_id == "GraspDisplacement-v1" and data.env_kwargs["control_mode"] == "grasp"
    only_won = ManiSkillTrajectoryDataset(str(trajectories), success_only=bool(joined.success[0]))
    assert len(only_won) == (joined.success.sum() if joined.success[0] else 12)


def test_groups_are_those_that_maniskill_records(trajectories, recorded):
    with h5py.File(trajectories) as ours, h5py.File(recorded) as theirs:
        exported, wanted = layout(ours["traj_0"]), layout(theirs["traj_0"])
        # The arm's joints are not stored in a dataset of grasps.
        unknown = {
            name for name in wanted if "agent" in name or "articulations" in name or "tcp_pose" in name
        }
        assert exported == {name: kind for name, kind in wanted.items() if name not in unknown}
        for name, value in theirs["traj_0/obs/sensor_param/overhead"].items():
            assert np.allclose(ours[f"traj_0/obs/sensor_param/overhead/{name}"], value, atol=1e-5), name
        for name in ("obs/extra/part_pose", "env_states/actors/part"):
            assert np.allclose(ours[f"traj_0/{name}"][0, :7], theirs[f"traj_0/{name}"][0, :7], atol=2e-3), (
                name
            )
    ours_json, theirs_json = (
        json.loads(p.with_suffix(".json").read_text()) for p in (trajectories, recorded)
    )
    assert set(theirs_json) <= set(ours_json) and set(theirs_json["env_info"]) == set(ours_json["env_info"])
    assert set(theirs_json["episodes"][0]) <= set(ours_json["episodes"][0])


@pytest.mark.slow
def test_an_exported_attempt_is_reproduced_from_its_files_alone(trajectories, joined):
    record = json.loads(trajectories.with_suffix(".json").read_text())
    kwargs = dict(record["env_info"]["env_kwargs"], obs_mode="none", render_backend="none")
    logging.getLogger("mani_skill").setLevel(logging.ERROR)
    first = record["episodes"][0]["reset_kwargs"]["options"]["parts"]
    env = gymnasium.make(record["env_info"]["env_id"], parts=first, **kwargs)
    rows = np.flatnonzero(joined.success)
    assert len(rows)
    agree = 0
    with h5py.File(trajectories) as file:
        for row in rows:
            env.reset(**record["episodes"][row]["reset_kwargs"])
            state = index_dict(file[f"traj_{row}/env_states"], 0)
            env.unwrapped.set_state_dict({"actors": {"part": torch.as_tensor(state["actors"]["part"])}})
            pose = env.unwrapped.part_pose().as_vector()[0].numpy()
            assert np.allclose(pose, joined.pose_base_obj[row], atol=1e-5)
            info = env.step(file[f"traj_{row}/actions"][:])[-1]
            known = record["episodes"][row]["info"]
            moved = np.linalg.norm(np.array(known["displacement"])[:3] - info["displacement"][0, :3].numpy())
            agree += bool(info["success"]) and moved < 2e-3
            if bool(info["success"]) and moved < 2e-3:
                after = env.unwrapped.part_pose().as_vector()[0].numpy()
                assert np.allclose(file[f"traj_{row}/obs/extra/part_pose"][1, :3], after[:3], atol=3e-3)
    env.close()
    # A grasp on an edge may end otherwise; not most of them.
    assert agree > len(rows) / 2


def test_the_pose_after_a_failure_is_not_known(trajectories, joined):
    row = int(np.flatnonzero(~joined.success)[0])
    with h5py.File(trajectories) as file:
        poses = file[f"traj_{row}/obs/extra/part_pose"][:]
    assert np.isfinite(poses[0]).all() and np.isnan(poses[1]).all()
    episode = json.loads(trajectories.with_suffix(".json").read_text())["episodes"][row]
    assert episode["info"]["failure"] == FAILURES[joined.failure[row]] and not episode["success"]
    assert "displacement" not in episode["info"]


@pytest.mark.parametrize(
    ("stored", "coarse"), [("", 500), (', "coarse_rate_hz": 250', 250)], ids=["old", "of today"]
)
def test_shards_of_before_the_coarse_rate_are_exported_as_they_were_made(tmp_path, stored, coarse):
    folder = synthetic.write_dataset(tmp_path / "boxes", n_parts=1, n_attempts=3, seed=0)
    with h5py.File(list_shards(folder)[0], "r+") as file:
        file.attrs["physics"] = f'{{"lift_height": 0.1, "rate_hz": 500{stored}}}'
    export_maniskill(folder, tmp_path / "x.h5")
    env_info = json.loads((tmp_path / "x.json").read_text())["env_info"]
    assert env_info["env_kwargs"]["physics"]["coarse_rate_hz"] == coarse


def test_settings_that_the_task_no_longer_has_are_not_exported_to_it(tmp_path):
    folder = synthetic.write_dataset(tmp_path / "boxes", n_parts=1, n_attempts=3, seed=0)
    with h5py.File(list_shards(folder)[0], "r+") as file:
        file.attrs["physics"] = json.dumps(
            Physics(coarse_rate_hz=250, lift_height=0.15).model_dump() | dict(coarse_mass=0.04)
        )
    export_maniskill(folder, tmp_path / "x.h5")
    env_info = json.loads((tmp_path / "x.json").read_text())["env_info"]
    kwargs = dict(env_info["env_kwargs"], obs_mode="none", render_backend="none", parts=["washer_m36"])
    env = gymnasium.make(env_info["env_id"], **kwargs)
    assert env.unwrapped.physics == Physics(coarse_rate_hz=250, lift_height=0.15)
    env.close()
