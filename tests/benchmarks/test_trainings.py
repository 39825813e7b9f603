"""The engine of trainings: what is stored, shared and refused."""

from __future__ import annotations

import json
import multiprocessing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from mskgrasp.core.errors import UsageError
from mskgrasp.core.files import exclusive_lock
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.learning.sides import Sides, split
from mskgrasp.learning.stage import Reporter
from tests.benchmarks.choice import Choice, Looks, Predictions
from tests.benchmarks.conftest import Boxes
from tests.benchmarks.paper_choices import with_stages
from tests.benchmarks.training_cost import cost_of, cost_table
from tests.benchmarks.trainings import make_trainings
from tests.benchmarks.trainings_at_once import TrainingFailed
from tests.learning.small import SHORT

CONFIG = SHORT.model_copy(update={"sides": "catalogue"})
OWN = Choice(name="Own", config=CONFIG)
OTHER = Choice(
    name="Mean only", quality_of="Own",
    config=CONFIG.model_copy(update={"network": CONFIG.network.model_copy(update={"variance": False})}),
)  # fmt: skip


@pytest.fixture
def looks(boxes: Boxes) -> Looks:
    return Looks(boxes.data, (0.0, 1.0))


@pytest.fixture
def sides(looks: Looks) -> Sides:
    return split(looks.of(CONFIG.network), CONFIG)


def made(looks: Looks, sides: Sides, out: Path, choices: list[Choice], seeds: int = 1, at_once: int = 1):
    groups = {"validation": sides.validation}
    return make_trainings(
        choices, seeds=seeds, looks=looks, sides=sides, groups=groups, out=out, measure_s=0.01,
        at_once=at_once,
    )  # fmt: skip


@pytest.mark.slow
def test_a_choice_can_take_the_quality_network_of_another(looks, sides, tmp_path):
    found = made(looks, sides, tmp_path, [OWN, OTHER])
    assert len(found["Own"][0]["validation"].quality) == len(sides.validation)
    assert not len(found["Mean only"][0]["validation"].quality)
    assert np.isnan(found["Mean only"][0]["validation"].variance).all()
    own, other = (load_models(choice.folder(tmp_path, 0)).gqn.state_dict() for choice in (OWN, OTHER))
    assert all(torch.equal(own[name], other[name]) for name in own)


def test_a_group_that_is_asked_for_later_is_predicted_by_the_stored_networks(looks, sides, tmp_path):
    first = made(looks, sides, tmp_path, [OWN])["Own"][0]["validation"]
    weights = OWN.folder(tmp_path, 0) / "model.safetensors"
    before = weights.stat().st_mtime_ns
    groups = {"validation": sides.validation, "test": sides.test}
    both = make_trainings(
        [OWN], seeds=1, looks=looks, sides=sides, groups=groups, out=tmp_path, measure_s=0.01
    )["Own"][0]
    assert weights.stat().st_mtime_ns == before
    np.testing.assert_array_equal(both["validation"].mean, first.mean)
    assert len(both["test"].quality) == len(sides.test)


class _Stopped(Exception):
    pass


@pytest.mark.slow
def test_a_stopped_training_goes_on_to_the_same_predictions(looks, sides, tmp_path, monkeypatch):
    whole = made(looks, sides, tmp_path / "whole", [OWN])["Own"][0]["validation"]

    def stop(self: Reporter, history: list[object]) -> None:
        if len(history) == 3:
            raise _Stopped

    with monkeypatch.context() as patch:
        patch.setattr("tests.benchmarks.training_cost.TimeLeft.epoch", stop)
        with pytest.raises(_Stopped):
            made(looks, sides, tmp_path / "stopped", [OWN])
    folder = OWN.folder(tmp_path / "stopped", 0)
    assert (folder / "checkpoint.safetensors").exists() and not (folder / "validation.npz").exists()
    resumed = made(looks, sides, tmp_path / "stopped", [OWN])["Own"][0]["validation"]
    np.testing.assert_array_equal(resumed.mean, whole.mean)
    assert not (folder / "checkpoint.safetensors").exists()


@pytest.mark.slow
def test_trainings_in_processes_of_their_own_are_the_same(looks, sides, tmp_path):
    in_turn = made(looks, sides, tmp_path / "in_turn", [OWN, OTHER], seeds=2)
    at_once = made(looks, sides, tmp_path / "at_once", [OWN, OTHER], seeds=2, at_once=3)
    for name, seeds in in_turn.items():
        for one, other in zip(seeds, at_once[name], strict=True):
            np.testing.assert_array_equal(other["validation"].mean, one["validation"].mean)
            np.testing.assert_array_equal(other["validation"].quality, one["validation"].quality)


@pytest.mark.slow
def test_a_training_that_fails_in_a_process_of_its_own_ends_the_others(looks, sides, tmp_path, capfd):
    wild = replace(OWN, config=with_stages(CONFIG, learning_rate=1e30))
    with pytest.raises(
        TrainingFailed, match="the training of Own with seed . failed .exit code 1.: see above"
    ):
        made(looks, sides, tmp_path, [wild], seeds=2, at_once=2)
    assert "Own with seed " in (told := capfd.readouterr().err) and "loss became nan" in told
    assert not multiprocessing.active_children()


def test_a_folder_of_other_settings_or_attempts_is_refused(looks, sides, tmp_path):
    made(looks, sides, tmp_path, [OWN])
    with pytest.raises(UsageError, match="training of other settings; choose another --out"):
        made(looks, sides, tmp_path, [replace(OWN, config=CONFIG.model_copy(update={"noise_std": 0.0}))])
    fewer = replace(sides, training=sides.training[::2])
    with pytest.raises(UsageError, match="training of other rows"):
        made(looks, fewer, tmp_path, [OWN])
    made_of = OWN.folder(tmp_path, 0) / "made_of.json"
    known = json.loads(made_of.read_text())
    predicted = made_of.with_name("validation.npz")
    before = predicted.stat().st_mtime_ns
    made_of.write_text(json.dumps({name: known[name] for name in known if name != "validation grasps"}))
    with pytest.raises(UsageError, match="training of other rows"):
        made(looks, fewer, tmp_path, [OWN])
    assert predicted.stat().st_mtime_ns == before  # what is refused is left alone
    made(looks, sides, tmp_path, [OWN])  # nobody knows of which grasps: they are predicted again
    assert predicted.stat().st_mtime_ns > before and json.loads(made_of.read_text()) == known
    some = {"validation": sides.validation[::2]}
    with pytest.raises(UsageError, match="training of other validation grasps"):
        make_trainings([OWN], seeds=1, looks=looks, sides=sides, groups=some, out=tmp_path, measure_s=0.01)


@pytest.mark.slow
def test_a_training_of_another_process_is_left_to_it(looks, sides, tmp_path):
    folder = OWN.folder(tmp_path, 0)
    folder.mkdir(parents=True)
    with (
        exclusive_lock(folder),
        pytest.raises(UsageError, match="another process trains Own with seed 0, Mean"),
    ):
        made(looks, sides, tmp_path, [OWN, OTHER])
    with (
        exclusive_lock(folder),
        pytest.raises(UsageError, match="another process trains Own with seed 0, Mean"),
    ):
        made(looks, sides, tmp_path, [OWN, OTHER], at_once=2)
    assert not list(tmp_path.rglob("*.npz"))
    assert set(made(looks, sides, tmp_path, [OWN, OTHER])) == {"Own", "Mean only"}


def test_patches_around_parts_and_grasps_are_read_once(boxes, looks):
    network = CONFIG.network.model_copy(update={"image": "object"})
    around_parts = looks.of(network)
    looks.data = boxes.data.parent / "absent"
    around_grasps = looks.of(CONFIG.network)
    assert around_grasps.object_patches is None and around_parts.object_patches is not None
    assert torch.equal(around_grasps.patches, around_parts.patches)


def test_the_time_of_a_training_follows_from_its_steps(looks, sides):
    cost = cost_of(OWN, looks.of(CONFIG.network), sides, 0.05)
    n = int(looks.of(CONFIG.network).success[sides.training].sum())
    assert cost.samples["gdn"] == n and set(cost.samples) == {"gqn", "gdn"}
    steps = {name: -(-cost.samples[name] // 32) for name in ("gqn", "gdn")}
    epochs = {"gqn": CONFIG.gqn.epochs, "gdn": CONFIG.gdn.epochs}
    expected = sum(
        epochs[name] * (steps[name] * 32 / cost.samples_per_s[name] + cost.validation_s[name])
        for name in steps
    )
    assert cost.total_s == pytest.approx(expected)
    table = cost_table([OWN, OTHER], looks, sides, seconds=0.01)
    assert [row[0] for row in table.rows] == ["Own", "Mean only"] and table.rows[1][1] is None


def test_predictions_survive_the_disk(tmp_path):
    one = Predictions(quality=np.array([0.25]), mean=np.ones((2, 4)), variance=np.full((2, 4), np.nan))
    one.write(tmp_path / "one.npz")
    again = Predictions.read(tmp_path / "one.npz")
    for name in ("quality", "mean", "variance"):
        np.testing.assert_array_equal(getattr(again, name), getattr(one, name))
