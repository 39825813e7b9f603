"""What the oracles are given is true, and the command runs from a dataset to a table."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from mskgrasp.core.config import read_config
from mskgrasp.dataset import list_shards, read_shard, write_shard
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.sides import Sides, split
from tests.benchmarks import oracles
from tests.benchmarks.oracle_networks import OracleSamples
from tests.benchmarks.oracles import BASELINE, SuccessLooks, drawn_values, oracle_choices
from tests.benchmarks.paper_choices import CONFIGS
from tests.programs import run_here

CONFIG = read_config(LearningConfig, CONFIGS / "pretrained.yaml").model_copy(update={"noise_std": 0.0})


@pytest.fixture
def looks(boxes) -> SuccessLooks:
    return SuccessLooks(boxes.data, (0.0, 1.0), CONFIG.network)


@pytest.mark.slow
def test_all_successes_and_some_failures_are_kept(boxes, looks):
    samples = looks.of(CONFIG.network)
    successes = sum(int(read_shard(path)[0].success.sum()) for path in list_shards(boxes.data))
    assert int(samples.success.sum()) == successes
    assert 0 < int((~samples.success).sum()) < 0.2 * (8 * 48 - successes)


def test_mass_and_centre_are_the_parts_own(boxes, looks, tmp_path):
    samples = looks.of(CONFIG.network)
    (choice,) = (c for c in oracle_choices(CONFIG, boxes.data, tmp_path) if c.name.startswith("mass"))
    given = choice.samples(samples)
    assert isinstance(given, OracleSamples) and given.point is not None
    row = int(torch.nonzero(samples.success)[-1])
    length, width, height = boxes.sizes[samples.parts[int(samples.part[row])]]
    mass = 2700.0 * length * width * height
    assert float(given.numbers[row, 0].exp()) * 0.1 == pytest.approx(mass, rel=1e-3)
    # Up to one unit for all, the true centre.
    unit = samples.origin_grasp[row].norm() / given.point[row].norm()
    torch.testing.assert_close(given.point * unit, samples.origin_grasp, atol=1e-6, rtol=1e-5)


def test_drawn_values_are_found_for_every_attempt(boxes, looks, tmp_path):
    drawn = {}
    for path in list_shards(boxes.data):
        attempts, info = read_shard(path)
        friction = (0.3 + 0.01 * attempts.attempt).astype("float32")
        write_shard(tmp_path / "shards" / path.name, replace(attempts, friction_pad_part=friction), info)
        drawn[info.part] = dict(zip(attempts.grasp[:, 3].tolist(), friction.tolist(), strict=True))
    samples = looks.of(CONFIG.network)
    found = drawn_values(samples, tmp_path)
    expected = [
        drawn[samples.parts[int(p)]][float(t)] for p, t in zip(samples.part, samples.theta, strict=True)
    ]
    torch.testing.assert_close(found[:, 0], torch.tensor(expected))
    assert found[:, 1].unique().tolist() == [30.0]


def test_few_parts_with_many_grasps_and_many_with_few_are_as_many_successes(boxes, looks, tmp_path):
    samples = looks.of(CONFIG.network)
    whole = split(samples, CONFIG)
    few, many = (
        c.sides(samples, whole).training
        for c in oracle_choices(CONFIG, boxes.data, tmp_path)
        if c.name.startswith(("a tenth", "as many"))
    )
    assert len(torch.unique(samples.part[few])) == 1 and len(torch.unique(samples.part[many])) > 1
    assert int(samples.success[few].sum()) == int(samples.success[many].sum()) > 0
    assert torch.isin(few, whole.training).all() and torch.isin(many, whole.training).all()
    assert isinstance(whole, Sides)


@pytest.mark.slow
def test_the_command_runs_from_a_dataset_to_a_report(boxes, tmp_path: Path):
    done = run_here(oracles.main, "--data", str(boxes.data), "--out", str(tmp_path), "--quick")
    assert done.returncode == 0, done.stderr
    scores = json.loads((tmp_path / "report.json").read_text())["scores"]
    assert list(scores)[0] == BASELINE and len(scores) == 9
    assert len({one["translation"]["mean"] for one in scores.values()}) == 9
    assert len(list((tmp_path / "images").iterdir())) == 4


def test_a_part_that_has_changed_is_refused(boxes, tmp_path: Path):
    for path in list_shards(boxes.data):
        attempts, info = read_shard(path)
        write_shard(tmp_path / "shards" / path.name, attempts, replace(info, part_hash="other"))
    done = run_here(oracles.main, "--data", str(tmp_path), "--out", str(tmp_path / "out"), "--quick")
    assert done.returncode == 2 and "part box_0 has changed" in done.stderr
