"""Attempts of a shard: determined by the seed, discarded for stated reasons, stored as simulated."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch

from mskgrasp.collect.config import CollectConfig
from mskgrasp.core.config import read_config
from mskgrasp.core.errors import UsageError
from mskgrasp.core.grasp import MAX_DISPLACEMENT, lowest_grasp_z
from mskgrasp.core.settings import REGION, TABLE_Z, ExecutionNoise, Overhead, Physics
from mskgrasp.dataset import list_shards, read_shard
from mskgrasp.dataset.labels import export_labels, read_labels
from mskgrasp.parts import find_part
from mskgrasp.simulation import shard
from mskgrasp.simulation.shard import FIELDS, MOST_REDRAWS, Simulator, discard_reason, draw_attempt
from mskgrasp.simulation.shard_task import ShardTask
from tasks.attempt.outcome import MAX_PENETRATION, MAX_SPEED
from tests.collecting import PARTS

PART = PARTS[1]


@pytest.fixture(scope="module")
def simulator(collected: Path) -> Iterator[Simulator]:
    config = read_config(CollectConfig, collected / "config.yaml")
    made = Simulator(config.physics, config.camera, config.noise)
    yield made
    made.close()


def test_a_shard_has_the_bytes_that_another_process_made(
    simulator: Simulator, collected: Path, tmp_path: Path
):
    (tmp_path / "shards").mkdir()
    folder = str(find_part(PART).folder)
    # The second shard first: no shard depends on those before it.
    task = ShardTask(part=PART, folder=folder, index=1, first=3, n=3, seed=5)
    yields = list(simulator.write(task, tmp_path))
    (path,) = list_shards(tmp_path)
    assert path.read_bytes() == (collected / "shards" / path.name).read_bytes()
    attempts, info = read_shard(path)
    assert [one for one in yields if one >= 0] == attempts.success.astype(int).tolist()
    assert yields.count(-1) == sum(info.discarded.values())


def test_a_shard_is_made_again_from_its_labels_and_its_seed(
    simulator: Simulator, collected: Path, tmp_path: Path
):
    export_labels(collected, tmp_path / "all.labels")
    labels = read_labels([tmp_path / "all.labels"])[PART, 1]
    task = ShardTask(part=PART, folder=str(find_part(PART).folder), index=1, first=3, n=3, seed=5)
    yields = list(simulator.restore(task, labels, tmp_path))
    (path,) = list_shards(tmp_path)
    (attempts, info), (before, info_before) = read_shard(path), read_shard(collected / "shards" / path.name)
    assert np.array_equal(attempts.depth, before.depth) and np.array_equal(attempts.grasp, before.grasp)
    assert attempts.displacement == pytest.approx(before.displacement, abs=3e-6, nan_ok=True)
    assert info.discarded == info_before.discarded and info.versions == info_before.versions
    assert [one for one in yields if one >= 0] == before.success.astype(int).tolist()
    with pytest.raises(UsageError, match="not those of attempts 0 to 2"):
        list(simulator.restore(dataclasses.replace(task, first=0), labels, tmp_path))


def test_an_attempt_whose_scene_comes_out_differently_is_discarded(
    simulator: Simulator, collected: Path, tmp_path: Path
):
    export_labels(collected, tmp_path / "all.labels")
    labels = read_labels([tmp_path / "all.labels"])[PART, 1]
    poses = labels.columns["pose_base_obj"].copy()
    poses[0, 0] += 0.02  # as if another resting pose had been drawn
    elsewhere = dataclasses.replace(labels, columns=labels.columns | {"pose_base_obj": poses})
    task = ShardTask(part=PART, folder=str(find_part(PART).folder), index=1, first=3, n=3, seed=5)
    yields = list(simulator.restore(task, elsewhere, tmp_path))
    (path,) = list_shards(tmp_path)
    (attempts, info), (before, _) = read_shard(path), read_shard(collected / "shards" / path.name)
    assert info.discarded == labels.info.discarded | {"lies_otherwise": 1}
    assert (
        np.array_equal(attempts.depth, before.depth[1:]) and len(attempts) + sum(info.discarded.values()) == 3
    )
    assert len(yields) == 3 and yields[0] == -1
    # Labels of a dataset that was restored so count one already: their shard is as whole as any.
    export_labels(tmp_path, tmp_path / "restored.labels")
    restored = read_labels([tmp_path / "restored.labels"])[PART, 1]
    poses = restored.columns["pose_base_obj"].copy()
    poses[0, 0] += 0.01
    elsewhere = dataclasses.replace(restored, columns=restored.columns | {"pose_base_obj": poses})
    list(simulator.restore(task, elsewhere, tmp_path / "again"))
    attempts, info = read_shard(list_shards(tmp_path / "again")[0])
    assert info.discarded["lies_otherwise"] == 2 and len(attempts) + sum(info.discarded.values()) == 3


def test_force_and_friction_of_each_attempt_are_those_that_were_drawn(tmp_path: Path):
    noise = ExecutionNoise(finger_force=(30.0, 70.0), friction_pad_part=(0.3, 0.8))
    drawing = Simulator(Physics(), Overhead(), noise)
    task = ShardTask(part=PART, folder=str(find_part(PART).folder), index=0, first=0, n=3, seed=5)
    list(drawing.write(task, tmp_path))
    drawing.close()
    attempts, _ = read_shard(list_shards(tmp_path)[0])
    assert attempts.attempt.tolist() == [0, 1, 2]
    assert len(set(attempts.finger_force)) == len(set(attempts.friction_pad_part)) == 3
    assert ((attempts.finger_force > 30) & (attempts.finger_force < 70)).all()
    assert ((attempts.friction_pad_part > 0.3) & (attempts.friction_pad_part < 0.8)).all()


def test_a_shard_without_attempts_can_be_read(simulator: Simulator, tmp_path: Path):
    (tmp_path / "shards").mkdir()
    task = ShardTask(part=PART, folder=str(find_part(PART).folder), index=0, first=0, n=0, seed=5)
    assert list(simulator.write(task, tmp_path)) == []
    attempts, info = read_shard(list_shards(tmp_path)[0])
    assert len(attempts) == 0 and attempts.depth.shape == (0, 160, 160) and info.part == PART


def test_seed_number_and_redraw_determine_an_attempt_whatever_was_drawn_before(simulator: Simulator):
    env = simulator.load(str(find_part(PART).folder))
    first = draw_attempt(env, PART, 5, 0)
    others = [draw_attempt(env, PART, *which) for which in ((5, 1), (6, 0), (5, 0, 1))]
    again = draw_attempt(env, PART, 5, 0)
    assert first[1] is not None and again[1] is not None
    np.testing.assert_array_equal(first[0], again[0])
    np.testing.assert_array_equal(first[1], again[1])
    for depth, grasp in others:
        assert not np.array_equal(depth, first[0])
        assert grasp is not None and not np.array_equal(grasp, first[1])
        assert grasp.shape == (1, 4) and grasp[0, 2] >= lowest_grasp_z(TABLE_Z) - 1e-6
        assert REGION[0] <= grasp[0, 0] <= REGION[1] and REGION[2] <= grasp[0, 1] <= REGION[3]


def test_a_part_that_the_camera_does_not_see_has_no_grasp(simulator: Simulator, monkeypatch):
    env = simulator.load(str(find_part(PART).folder))
    begin = env.begin_episode

    def beside_the_region(seed: int) -> None:
        begin(seed)
        pose = env.part_pose().as_vector()[0].numpy()
        env.reset(seed=seed, options=dict(pose_base_obj=np.array([[0.5, 0.5, *pose[2:]]])))

    monkeypatch.setattr(env, "begin_episode", beside_the_region)
    depth, grasp = draw_attempt(env, PART, 5, 0)
    assert grasp is None and depth.shape == (160, 160)


@pytest.mark.slow
def test_a_part_that_is_not_at_rest_is_drawn_again_and_discarded_where_it_never_is(
    simulator: Simulator, monkeypatch
):
    """As if the part of the first attempt were at rest in its third scene, and that of the second in none."""
    reasons = iter(["unsettled"] * 2 + [""] + ["unsettled"] * (1 + MOST_REDRAWS))
    monkeypatch.setattr(shard, "discard_reason", lambda *_: next(reasons))
    task = ShardTask(part=PART, folder=str(find_part(PART).folder), index=0, first=0, n=2, seed=5)
    run, yields = simulator.run(task), []
    with pytest.raises(StopIteration) as ended:
        while True:
            yields.append(next(run))
    attempts, info = ended.value.value
    assert yields[0] in (0, 1) and yields[1:] == [-1] and len(attempts) == 1
    assert info.redrawn == 2 + MOST_REDRAWS and info.discarded == {"unsettled": 1}
    assert next(reasons, None) is None
    # The attempt that is kept is that of the third scene.
    third = draw_attempt(simulator.load(task.folder), PART, 5, 0, 2)
    np.testing.assert_array_equal(attempts.depth[0], third[0])


def attempt(**changes: float) -> tuple[dict[str, torch.Tensor], dict[str, np.ndarray]]:
    """What is known of a good attempt, and its row, with some values changed."""
    good = dict(executable=1.0, settled=1.0, penetration=0.0, fastest=0.5, success=1.0, moved=0.01, pose=0.0)
    values = good | changes
    outcome = {name: torch.tensor([value]) for name, value in values.items()}
    row = {name: np.zeros(7, np.float32) for name in FIELDS if name.startswith("pose")}
    row["pose_tcp_obj_after"] = np.full(7, values["pose"], np.float32)
    row |= dict(
        success=np.asarray(bool(values["success"])), displacement=np.array([0, values["moved"], 0, 0])
    )
    return outcome, row


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        (dict(), ""),
        (dict(executable=0.0), "unreachable"),
        (dict(settled=0.0), "unsettled"),
        (dict(settled=0.0, pose=float("nan")), "unsettled"),
        (dict(pose=float("inf")), "not_finite"),
        (dict(penetration=float("nan")), "overlap_unknown"),
        (dict(penetration=MAX_PENETRATION * 0.999), ""),
        (dict(penetration=MAX_PENETRATION * 1.001), "penetrated"),
        (dict(fastest=MAX_SPEED * 1.001), "too_fast"),
        (dict(moved=MAX_DISPLACEMENT * 1.001), "moved_too_far"),
        (dict(moved=MAX_DISPLACEMENT * 1.001, success=0.0), ""),
    ],
)
def test_an_attempt_is_discarded_for_the_first_reason_that_holds(changes: dict[str, float], reason: str):
    assert discard_reason(*attempt(**changes)) == reason
