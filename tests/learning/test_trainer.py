from __future__ import annotations

import dataclasses
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from mskgrasp.core import metrics
from mskgrasp.core.errors import BadDataset, BadModel, UsageError
from mskgrasp.learning.config import LearningConfig, StageConfig
from mskgrasp.learning.grasp_models import Models, load_models, save_model
from mskgrasp.learning.held_out import calibrate, predict_grasp_displacement
from mskgrasp.learning.model_metrics import EpochMetrics
from mskgrasp.learning.samples import Samples, read_samples
from mskgrasp.learning.sides import split
from mskgrasp.learning.stage import Reporter, TrainingDiverged
from mskgrasp.learning.trainer import train as learn
from tests import synthetic
from tests.learning.small import HAND, PATCH, SHORT

Learned = tuple[Models, list[EpochMetrics]]


@pytest.fixture(scope="module")
def learned(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Samples, LearningConfig], Learned]:
    """Trainings that nothing stops; the same one is made once, and its networks are not to be changed."""
    made: dict[str, Learned] = {}

    def train(samples: Samples, config: LearningConfig) -> Learned:
        key = config.model_dump_json()  # the network in it decides how the dataset is seen
        if key not in made:
            path = tmp_path_factory.mktemp("whole") / "checkpoint.safetensors"
            made[key] = learn(samples, config, checkpoint_path=path)
        return made[key]

    return train


@pytest.mark.slow
def test_one_success_is_no_batch_to_normalise(samples, tmp_path):
    training = split(samples, PATCH).training
    held = training[samples.success[training]]
    success = samples.success.clone()
    success[held[1:]] = False
    alike = dataclasses.replace(samples, success=success)
    config = SHORT.model_copy(update={"gdn": SHORT.gdn.model_copy(update={"batch_norm": True})})
    with pytest.raises(BadDataset, match="batch_norm: true needs two successes"):
        learn(alike, config, checkpoint_path=tmp_path / "c")


class StopAfter(Reporter):
    """Ctrl-C in the middle of the epoch that follows the n-th."""

    def __init__(self, n):
        self.left = n

    def epoch(self, history):
        self.left -= 1

    def batch(self, loss):
        if self.left == 0:
            raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("after", "batch_norm"),
    [*(pytest.param(n, False, marks=pytest.mark.slow) for n in (1, 2, 4)), (1, True), (4, True)],
)
def test_a_stopped_run_goes_on_to_the_same_weights(samples, learned, tmp_path, after, batch_norm):
    path = tmp_path / "checkpoint.safetensors"
    stages = {
        name: getattr(SHORT, name).model_copy(update={"batch_norm": batch_norm}) for name in ("gqn", "gdn")
    }
    config = SHORT.model_copy(update=stages)
    whole, history = learned(samples, config)
    with pytest.raises(KeyboardInterrupt):
        learn(samples, config, checkpoint_path=path, reporter=StopAfter(after))
    resumed, again = learn(samples, config, checkpoint_path=path)
    for one, other in ((whole.gqn, resumed.gqn), (whole.gdn, resumed.gdn)):
        assert all(
            torch.equal(a, b)
            for a, b in zip(one.state_dict().values(), other.state_dict().values(), strict=True)
        )
    assert [one.train_loss for one in again] == [one.train_loss for one in history]


def test_the_seed_decides_the_weights_and_the_global_generator_is_left_alone(samples, learned, tmp_path):
    first, _ = learned(samples, SHORT)
    torch.manual_seed(5)
    state = torch.get_rng_state()
    other, _ = learn(samples, SHORT.model_copy(update={"seed": 1}), checkpoint_path=tmp_path / "b")
    assert torch.equal(torch.get_rng_state(), state)
    assert not torch.equal(first.gqn.head[0].weight, other.gqn.head[0].weight)


@pytest.fixture(scope="module")
def first_epoch(samples, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("stopped") / "checkpoint.safetensors"
    with pytest.raises(KeyboardInterrupt):
        learn(samples, SHORT, checkpoint_path=path, reporter=StopAfter(1))
    return path


@pytest.fixture
def stopped(first_epoch: Path, tmp_path: Path) -> Path:
    """The checkpoint of a training that was stopped after its first epoch; a copy, to be changed."""
    return Path(shutil.copy(first_epoch, tmp_path))


def contents(path):
    """Tensors and metadata of a file."""
    with safe_open(path, framework="pt") as file:
        return {key: file.get_tensor(key) for key in file.keys()}, file.metadata()


def test_all_stages_share_one_copy_of_the_samples_on_the_device(samples, tmp_path, monkeypatch):
    copied, on = [], Samples.on
    monkeypatch.setattr(Samples, "on", lambda self, device: copied.append(str(device)) or on(self, device))
    stage = SHORT.gqn.model_copy(update={"epochs": 1})
    learn(samples, SHORT.model_copy(update={"gqn": stage, "gdn": stage}), checkpoint_path=tmp_path / "c")
    assert copied == ["cpu"]


def test_a_checkpoint_of_other_data_is_refused(samples, stopped):
    other = dataclasses.replace(samples, fingerprint="0")
    with pytest.raises(UsageError, match="other data"):
        learn(other, SHORT, checkpoint_path=stopped)


def test_a_checkpoint_of_another_split_is_refused(samples, stopped):
    sides = split(samples, SHORT)
    swapped = dataclasses.replace(sides, training=sides.validation, validation=sides.training)
    with pytest.raises(UsageError, match="other parts to train on or to validate on"):
        learn(samples, SHORT, checkpoint_path=stopped, sides=swapped)


def test_a_checkpoint_of_samples_made_otherwise_is_refused(samples, stopped):
    tensors, metadata = contents(stopped)
    progress = json.loads(metadata["progress"])
    del progress["samples_version"]  # as files were before samples had a version
    save_file(tensors, stopped, metadata={"progress": json.dumps(progress)})
    with pytest.raises(UsageError, match="made with version 1 of the samples, this is version 3"):
        learn(samples, SHORT, checkpoint_path=stopped)


def test_a_checkpoint_of_a_stage_that_is_not_trained_is_refused(samples, stopped):
    tensors, metadata = contents(stopped)
    progress = json.loads(metadata["progress"]) | {"stage": "transfer"}
    save_file(tensors, stopped, metadata={"progress": json.dumps(progress)})
    with pytest.raises(UsageError, match="made with other settings"):
        learn(samples, SHORT, checkpoint_path=stopped)


def test_a_checkpoint_whose_optimiser_learned_other_layers_is_refused(samples, stopped):
    tensors, metadata = contents(stopped)
    first, second = "optimiser/0/exp_avg", "optimiser/1/exp_avg"
    tensors[first], tensors[second] = tensors[second], tensors[first]
    save_file(tensors, stopped, metadata=metadata)
    with pytest.raises(BadModel, match="the optimiser's state is that of other layers"):
        learn(samples, SHORT, checkpoint_path=stopped)


def test_a_mean_only_network_and_the_papers_optimiser_can_be_trained(samples, tmp_path):
    stage = StageConfig(
        optimiser="rmsprop", learning_rate=1e-4, decay=1e-6, schedule="constant", epochs=1, batch_size=32
    )
    changes = {"network": PATCH.network.model_copy(update={"variance": False}), "gqn": stage, "gdn": stage}
    models, history = learn(samples, SHORT.model_copy(update=changes), checkpoint_path=tmp_path / "c")
    assert len(history) == 2 and models.meta.metrics["gdn"]["nll"] is None


@pytest.mark.slow
def test_a_network_can_learn_the_swing_and_is_judged_by_it(dataset, tmp_path):
    network = HAND.network.model_copy(update={"swing": True})
    longer = HAND.gdn.model_copy(update={"epochs": 40})
    samples = read_samples(dataset, network)
    # The synthetic boxes stay flat: here each swings about y as far as it is held off its centre.
    about_y = 10 * samples.centre_grasp[:, 0]
    samples = dataclasses.replace(samples, swing=torch.stack([torch.zeros_like(about_y), about_y], dim=1))
    config = HAND.model_copy(update={"network": network, "gqn": SHORT.gqn, "gdn": longer})
    models, _ = learn(samples, config, checkpoint_path=tmp_path / "c")
    gdn = models.meta.metrics["gdn"]
    assert list(gdn["axes"]["rmse"]) == ["x", "y", "z", "theta", "swing_x", "swing_y"]
    held = samples.success
    assert gdn["axes"]["rmse"]["swing_y"] < 0.5 * float(about_y[held].std())
    assert 0 <= gdn["least_uncertain"]["10%"][2] <= gdn["least_uncertain"]["30%"][2] + 0.2


@pytest.mark.slow
@pytest.mark.parametrize(
    "config", [pytest.param(SHORT, marks=pytest.mark.slow), HAND], ids=["the paper's", "ours"]
)
def test_what_learned_in_mixed_precision_is_as_good_and_predicts_in_float32(dataset, tmp_path, config):
    config = config.model_copy(update={"gqn": SHORT.gqn, "gdn": SHORT.gdn})
    samples = read_samples(dataset, config.network)
    plain, history = learn(samples, config, checkpoint_path=tmp_path / "plain")
    mixed, again = learn(
        samples, config.model_copy(update={"mixed_precision": True}), checkpoint_path=tmp_path / "mixed"
    )
    assert all(value.dtype == torch.float32 for value in mixed.gdn.state_dict().values())
    losses = np.array([[one.validation_loss for one in run] for run in (history, again)])
    assert 0 < np.abs(losses[0] - losses[1]).max() < 0.1 * np.abs(losses[0]).max()
    rows = torch.arange(20)
    assert mixed.gdn.features.mixed_precision and not plain.gdn.features.mixed_precision
    first = predict_grasp_displacement(mixed, samples, rows)
    mixed.gdn.features.mixed_precision = False
    for one, other in zip(first, predict_grasp_displacement(mixed, samples, rows), strict=True):
        assert np.array_equal(one, other)


def test_a_loss_that_is_no_number_stops_the_run_in_one_line(samples, tmp_path):
    wild = StageConfig(learning_rate=1e30, schedule="constant", epochs=2, batch_size=32)
    with pytest.raises(TrainingDiverged, match="gqn.learning_rate") as caught:
        learn(samples, SHORT.model_copy(update={"gqn": wild}), checkpoint_path=tmp_path / "c")
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_the_hand_network_learns_what_the_centre_alone_does_not_tell_and_is_calibrated(tmp_path):
    dataset = synthetic.write_dataset(tmp_path, n_parts=8, n_attempts=250, seed=1)
    samples = read_samples(dataset, HAND.network)
    models, _ = learn(samples, HAND, checkpoint_path=tmp_path / "checkpoint")
    report, found = models.meta.metrics, models.meta.calibration
    rows = split(samples, HAND).validation
    distance = np.linalg.norm(samples.centre_grasp[rows, :2].numpy(), axis=1)
    by_distance = metrics.auroc(-distance, samples.success[rows].numpy())
    assert 0.6 < by_distance < report["gqn"]["auroc"] - 0.1
    # The closing jaw centres a box: 85 % of its motion can be foreseen. The turn takes more samples.
    assert report["gdn"]["translation_rmse"] < 0.25 * report["gdn"]["training_mean"]["translation_rmse"]
    assert report["gdn"]["n"] >= 50 and found == calibrate(models, samples, rows)
    assert found.quality_slope > 0 and min(found.variance_scale) > 0 and max(found.variance_scale) != 1.0
    save_model(tmp_path / "model", models)
    assert load_models(tmp_path / "model").meta.calibration == found


@pytest.mark.slow
def test_training_ends_when_the_validation_loss_stops_falling_and_resumes_to_the_same_end(samples, tmp_path):
    # A rate this high does not improve for long.
    stage = StageConfig(learning_rate=0.05, schedule="constant", epochs=40, batch_size=32, patience=2)
    config = SHORT.model_copy(update={"gqn": stage, "gdn": stage})
    whole, history = learn(samples, config, checkpoint_path=tmp_path / "whole")
    for name in ("gqn", "gdn"):
        losses = [one.validation_loss for one in history if one.stage == name]
        assert len(losses) < 40
        assert losses.index(min(losses)) == len(losses) - 1 - 2
    path = tmp_path / "checkpoint"
    with pytest.raises(KeyboardInterrupt):
        learn(samples, config, checkpoint_path=path, reporter=StopAfter(len(history) - 1))
    resumed, again = learn(samples, config, checkpoint_path=path)
    assert [one.train_loss for one in again] == [one.train_loss for one in history]
    assert torch.equal(whole.gdn.mean_head[0].weight, resumed.gdn.mean_head[0].weight)


def test_a_trained_quality_network_is_taken_over(samples, learned, tmp_path):
    first, history = learned(samples, SHORT)
    other, again = learn(samples, SHORT, checkpoint_path=tmp_path / "b", quality=first.gqn)
    assert {one.stage for one in again} == {"gdn"}
    pairs = [(first.gqn, other.gqn), (first.gdn, other.gdn)]  # the same start, the same displacement network
    for one, same in pairs:
        for a, b in zip(one.state_dict().values(), same.state_dict().values(), strict=True):
            assert torch.equal(a, b)
    assert [one.train_loss for one in again] == [one.train_loss for one in history if one.stage == "gdn"]
