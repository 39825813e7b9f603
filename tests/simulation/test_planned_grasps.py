"""Grasps that a planner chooses for attempts: by stated shares, stored with the digest of its model."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from hal.camera import RgbdFrame
from mskgrasp.core.errors import BadModel, MissingModel, NoPartFound
from mskgrasp.core.settings import REGION, TABLE_Z, ExecutionNoise, Overhead, Physics
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.dataset import list_shards, read_shard
from mskgrasp.dataset.labels import export_labels, read_labels
from mskgrasp.learning.grasp_models import ModelMeta, build_models, load_models, save_model
from mskgrasp.learning.network_config import HandNetworkConfig, Normalisation
from mskgrasp.parts import find_part
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.planner import Planner
from mskgrasp.simulation.planned_grasps import N_CANDIDATES, SHARES, PlannedGrasps, planner_digest
from mskgrasp.simulation.shard import Simulator
from mskgrasp.simulation.shard_task import ShardTask
from tests.synthetic import INTRINSICS, OVERHEAD, Box, render

PART = "hex_nut_m30"
DEPTH = render([Box(x=0.45, y=0.02, yaw=0.4, size=(0.06, 0.03, 0.02))]).astype(np.float32)


@pytest.fixture(scope="module")
def planned() -> PlannedGrasps:
    return PlannedGrasps(PRETRAINED)


def test_a_grasp_is_that_of_one_of_the_planners_and_each_has_its_share(planned: PlannedGrasps):
    models = load_models(PRETRAINED)
    frame = RgbdFrame(
        colour=np.zeros((*DEPTH.shape, 3), np.uint8), depth=DEPTH, intrinsics=INTRINSICS,
        T_base_camera=OVERHEAD, timestamp_s=0.0, serial="",
    )  # fmt: skip
    settings = {
        "recentred": dict(),
        "low_variance": dict(recentre=False),
        "quality": dict(policy="quality"),
    }
    planners = {
        name: Planner(models, PlannerConfig(n_candidates=N_CANDIDATES, **one), table_z=TABLE_Z, region=REGION)
        for name, one in settings.items()
    }
    assert list(SHARES) == list(planners) and sum(SHARES.values()) == pytest.approx(1)
    # The first number that a generator draws: 0.51, 0.81 and 0.94.
    for seed, name in ((1, "recentred"), (5, "low_variance"), (4, "quality")):
        rng = np.random.default_rng(seed)
        rng.random()
        grasp = planned.choose(DEPTH, INTRINSICS, OVERHEAD, np.random.default_rng(seed))
        assert grasp == pytest.approx(planners[name].plan(frame, rng).grasp.as_vector(), abs=1e-9), name


def test_an_empty_table_has_no_grasp(planned: PlannedGrasps):
    with pytest.raises(NoPartFound):
        planned.choose(render([]).astype(np.float32), INTRINSICS, OVERHEAD, np.random.default_rng(0))


def test_the_digest_is_of_description_weights_and_settings(
    planned: PlannedGrasps, tmp_path: Path, monkeypatch
):
    assert planned.digest == planner_digest(PRETRAINED) and len(planned.digest) == 32
    for name in ("model.json", "model.safetensors"):
        folder = tmp_path / name
        shutil.copytree(PRETRAINED, folder)
        assert planner_digest(folder) == planned.digest
        (folder / name).write_bytes((folder / name).read_bytes() + b" ")
        assert planner_digest(folder) != planned.digest
    monkeypatch.setitem(SHARES, "quality", 0.2)
    assert planner_digest(PRETRAINED) != planned.digest
    with pytest.raises(MissingModel, match="train a model"):
        planner_digest(tmp_path)


def test_a_model_without_variances_chooses_no_grasps(tmp_path: Path):
    network = HandNetworkConfig(variance=False)
    numbers = Normalisation(
        action_scale=(0.05,) * 3, target_mean=(0.0,) * 4, target_std=(0.01,) * 4, base_rate=0.3
    )
    save_model(tmp_path, build_models(ModelMeta(network=network, normalisation=numbers)))
    with pytest.raises(BadModel, match="predicts no variance, by which grasps are chosen; name another"):
        PlannedGrasps(tmp_path)


def test_a_shard_of_planned_grasps_is_made_again_without_their_model(tmp_path: Path):
    made = Simulator(Physics(), Overhead(), ExecutionNoise(), planned_by=PRETRAINED)
    task = ShardTask(part=PART, folder=str(find_part(PART).folder), index=0, first=0, n=3, seed=5)
    yields = list(made.write(task, tmp_path / "one"))
    made.close()
    attempts, info = read_shard(list_shards(tmp_path / "one")[0])
    assert info.planner == planner_digest(PRETRAINED) and yields == [1, 1, 1]
    export_labels(tmp_path / "one", tmp_path / "one.labels")
    again = Simulator(Physics(), Overhead(), ExecutionNoise())
    list(again.restore(task, read_labels([tmp_path / "one.labels"])[PART, 0], tmp_path / "two"))
    again.close()
    restored, known = read_shard(list_shards(tmp_path / "two")[0])
    assert known.planner == info.planner
    assert np.array_equal(restored.depth, attempts.depth) and np.array_equal(restored.grasp, attempts.grasp)
