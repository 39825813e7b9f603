import csv
import dataclasses
import json

import numpy as np
import pytest
import torch

from mskgrasp.core.config import read_config
from mskgrasp.core.errors import BadDataset, BadModel, UsageError
from mskgrasp.dataset import shard_path, write_shard
from mskgrasp.learning.grasp_models import build_models, load_models, save_model
from mskgrasp.learning.held_out import predict_grasp_displacement
from mskgrasp.learning.network_config import HandNetworkConfig, PatchNetworkConfig
from mskgrasp.learning.samples import part_sides, read_samples
from mskgrasp.learning.trainer import (
    LearningConfig,
    Reporter,
    Stage,
    StageConfig,
    TrainingDiverged,
    describe,
    split,
)
from mskgrasp.learning.trainer import train as learn
from mskgrasp.runtime import cli
from mskgrasp.train import run as train
from mskgrasp.train.config import DEFAULT_CONFIG, TrainConfig
from tests import synthetic
from tests.programs import run_here

SMALL = PatchNetworkConfig(
    patch_pixels=40, channels=8, trunk_width=64, action_width=32, head_width=64, dropout=0.0
)
CONFIG = LearningConfig(
    validation_fraction=0.2,
    network=SMALL,
    noise_std=0.001,
    gqn=StageConfig(learning_rate=2e-3, epochs=12, batch_size=16),
    gdn=StageConfig(learning_rate=2e-3, epochs=30, batch_size=16),
)
SHORT = CONFIG.model_copy(
    update={
        "gqn": StageConfig(learning_rate=1e-3, epochs=2, batch_size=32),
        "gdn": StageConfig(learning_rate=1e-3, epochs=3, batch_size=32),
    }
)
HAND = CONFIG.model_copy(
    update={
        "network": HandNetworkConfig(
            patch_pixels=33,
            patch_side=0.132,
            quality_stride=2,
            quality_columns=9,
            layers=(8, 8),
            displacement_layers=(8, 16),
            trunk_width=32,
            action_width=32,
            head_width=32,
            dropout=0.0,
        ),
        "gqn": StageConfig(learning_rate=4e-3, epochs=14, batch_size=32),
        "gdn": StageConfig(learning_rate=4e-3, epochs=10, batch_size=16),
    }
)


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    # On busy cores threads that wait for each other make such small networks ten times slower.
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data")
    return synthetic.write_dataset(folder, n_parts=8, n_attempts=80, seed=1)


@pytest.fixture(scope="module")
def samples(dataset):
    return read_samples(dataset, SMALL)


def program(config: LearningConfig, **changes) -> TrainConfig:
    return TrainConfig(**(config.model_dump() | {"device": "cpu"} | changes))


def test_samples_hold_every_attempt_with_its_displacement_seen_from_the_estimated_centre(samples):
    assert len(samples) == 640 and samples.patches.shape == (640, 1, 40, 40)
    assert len(samples.parts) == 8 and not samples.skipped
    held = samples.success
    assert bool(torch.isfinite(samples.grasp_displacement[held]).all())
    assert bool(torch.isnan(samples.grasp_displacement[~held]).all())
    # Closing the jaw centres a box: along y the displacement undoes the centre's offset, to a pixel.
    sideways = samples.displacement[held][:, 1] + samples.centre_grasp[held][:, 1]
    assert float(sideways.abs().max()) < 0.0025


def held_out_of(names: tuple[str, ...], fraction: float) -> set[str]:
    return {name for name, side in part_sides(names, fraction, "name").items() if side == "validation"}


@pytest.mark.parametrize("image", ["grasp", "object"])
def test_several_processes_read_the_same_samples(dataset, image):
    network = SMALL.model_copy(update={"image": image})
    one, two = (read_samples(dataset, network, workers=n) for n in (1, 2))
    for field in dataclasses.fields(one):
        first, second = getattr(one, field.name), getattr(two, field.name)
        if isinstance(first, torch.Tensor):
            assert first.dtype == second.dtype and np.array_equal(
                first, second, equal_nan=first.is_floating_point()
            )
        else:
            assert first == second
    assert (one.object_patches is None) == (image == "grasp")


@pytest.mark.parametrize("workers", [1, 2])
def test_a_damaged_shard_is_named_whoever_reads_it(tmp_path, workers):
    dataset = synthetic.write_dataset(tmp_path, n_parts=3, n_attempts=20, seed=0)
    bad = sorted((dataset / "shards").glob("*.h5"))[1]
    bad.write_bytes(bad.read_bytes()[:500])
    with pytest.raises(BadDataset, match=bad.name):
        read_samples(dataset, SMALL, workers=workers)


def test_parts_are_split_by_name_and_stay_on_their_side():
    names = tuple(f"part_{k}" for k in range(400))
    held_out = held_out_of(names, 0.2)
    assert 50 < len(held_out) < 110
    fewer = names[:200]
    assert held_out_of(fewer, 0.2) == held_out & set(fewer)
    assert all(len(held_out_of(("a", "b"), share)) == 1 for share in (0.01, 0.99))
    with pytest.raises(BadDataset, match="at least 2 parts"):
        part_sides(("lonely",), 0.2, "name")


def test_validation_never_sees_a_part_of_training(samples):
    sides = split(samples, CONFIG)
    assert not set(samples.part[sides.training].tolist()) & set(samples.part[sides.validation].tolist())
    assert len(sides.training) + len(sides.validation) == len(samples) and not len(sides.test)


@pytest.mark.parametrize(("success", "words"), [(True, "no failure"), (False, "no success")])
def test_data_of_one_outcome_are_told(samples, success, words):
    alike = dataclasses.replace(samples, success=torch.full((len(samples),), success))
    with pytest.raises(BadDataset, match=words):
        split(alike, CONFIG)


def test_one_number_of_epochs_stands_for_both_networks_and_is_what_a_stopped_run_needs(dataset, tmp_path):
    out = tmp_path / "model"
    assert train.run(program(SHORT, data=dataset, out=out, epochs=1)) == 0
    with open(out / "log.csv") as file:
        assert [row["stage"] for row in csv.DictReader(file)] == ["gqn", "gdn"]
    kept = read_config(TrainConfig, out / "config.yaml")
    assert kept.gqn.epochs == kept.gdn.epochs == 1
    assert train.run(program(SHORT, data=dataset, out=out, epochs=1)) == 0
    with pytest.raises(UsageError, match="gdn"):
        train.run(program(SHORT, data=dataset, out=out))


def test_a_small_dataset_is_learned_and_beats_the_trivial_predictors(dataset, tmp_path):
    out = tmp_path / "model"
    config = CONFIG.model_copy(update={"validation_fraction": 0.4})  # one part alone has no interval
    assert train.run(program(config, data=dataset, out=out)) == 0
    report = json.loads((out / "metrics.json").read_text())
    gqn, gdn = report["gqn"], report["gdn"]
    assert gqn["auroc"] > 0.85
    assert gqn["brier"] < 0.8 * gqn["brier_of_base_rate"]
    for trivial in ("zero_displacement", "training_mean"):
        assert gdn["translation_rmse"] < 0.6 * gdn[trivial]["translation_rmse"]
        # Some 200 successes teach such a small network the shift; the turn takes thousands.
        assert gdn["nll"] < gdn[trivial]["nll"]
    assert set(gdn["coverage_90"]) == {"x", "y", "z", "theta"}
    models = load_models(out)
    assert models.meta.metrics["gqn"]["auroc"] == pytest.approx(gqn["auroc"])
    assert len(models.meta.training["training_parts"]) + len(models.meta.training["validation_parts"]) == 8
    with open(out / "log.csv") as file:
        rows = list(csv.DictReader(file))
    assert [row["stage"] for row in rows] == ["gqn"] * 12 + ["gdn"] * 30
    card = (out / "card.md").read_text()
    assert f"{gqn['auroc']:.3f}" in card and f"{1e3 * gdn['translation_rmse']:.2f}" in card
    assert str(dataset) not in card + (out / "model.json").read_text()
    low, high = gdn["intervals"]["translation_rmse"]
    assert 0 < gdn["ause_translation"] < 1 and low < gdn["translation_rmse"] < high
    files = {path.name for path in out.iterdir()}
    assert files == {
        "model.safetensors",
        "model.json",
        "metrics.json",
        "card.md",
        "uncertainty.png",
        "log.csv",
        "curves.png",
        "config.yaml",
    }
    # Started again, there is nothing to do; with other settings, the folder is taken.
    assert train.run(program(config, data=dataset, out=out)) == 0
    with pytest.raises(UsageError, match=r"other settings \(seed\)"):
        train.run(program(config, data=dataset, out=out, seed=1))


class StopAfter(Reporter):
    """Ctrl-C in the middle of the epoch that follows the n-th."""

    def __init__(self, n):
        self.left = n

    def epoch(self, history):
        self.left -= 1

    def batch(self, loss):
        if self.left == 0:
            raise KeyboardInterrupt


@pytest.mark.parametrize("after", [1, 2, 4])
def test_a_stopped_run_goes_on_to_the_same_weights(samples, tmp_path, after):
    path = tmp_path / "checkpoint.safetensors"
    whole, history = learn(samples, SHORT, checkpoint_path=tmp_path / "whole.safetensors")
    with pytest.raises(KeyboardInterrupt):
        learn(samples, SHORT, checkpoint_path=path, reporter=StopAfter(after))
    resumed, again = learn(samples, SHORT, checkpoint_path=path)
    for one, other in ((whole.gqn, resumed.gqn), (whole.gdn, resumed.gdn)):
        assert all(
            torch.equal(a, b)
            for a, b in zip(one.state_dict().values(), other.state_dict().values(), strict=True)
        )
    assert [row["train_loss"] for row in again] == [row["train_loss"] for row in history]


def test_the_seed_decides_the_weights_and_the_global_generator_is_left_alone(samples, tmp_path):
    torch.manual_seed(5)
    state = torch.get_rng_state()
    first, _ = learn(samples, SHORT, checkpoint_path=tmp_path / "a")
    assert torch.equal(torch.get_rng_state(), state)
    other, _ = learn(samples, SHORT.model_copy(update={"seed": 1}), checkpoint_path=tmp_path / "b")
    assert not torch.equal(first.gqn.head[0].weight, other.gqn.head[0].weight)


def test_a_checkpoint_of_other_data_or_a_damaged_one_is_refused(samples, tmp_path):
    path = tmp_path / "checkpoint.safetensors"
    with pytest.raises(KeyboardInterrupt):
        learn(samples, SHORT, checkpoint_path=path, reporter=StopAfter(1))
    other = dataclasses.replace(samples, fingerprint="0")
    with pytest.raises(UsageError, match="other data"):
        learn(other, SHORT, checkpoint_path=path)
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(BadModel, match="damaged"):
        learn(samples, SHORT, checkpoint_path=path)


def test_a_mean_only_network_and_the_papers_optimiser_can_be_trained(samples, tmp_path):
    stage = StageConfig(
        optimiser="rmsprop", learning_rate=1e-4, decay=1e-6, schedule="constant", epochs=1, batch_size=32
    )
    changes = {"network": SMALL.model_copy(update={"variance": False}), "gqn": stage, "gdn": stage}
    models, history = learn(samples, SHORT.model_copy(update=changes), checkpoint_path=tmp_path / "c")
    assert len(history) == 2 and models.meta.metrics["gdn"]["nll"] is None


@pytest.mark.parametrize("config", [SHORT, HAND], ids=["the paper's", "ours"])
def test_what_learned_in_mixed_precision_is_as_good_and_predicts_in_float32(dataset, tmp_path, config):
    config = config.model_copy(update={"gqn": SHORT.gqn, "gdn": SHORT.gdn})
    samples = read_samples(dataset, config.network)
    plain, history = learn(samples, config, checkpoint_path=tmp_path / "plain")
    mixed, again = learn(
        samples, config.model_copy(update={"mixed_precision": True}), checkpoint_path=tmp_path / "mixed"
    )
    assert all(value.dtype == torch.float32 for value in mixed.gdn.state_dict().values())
    losses = np.array([[row["validation_loss"] for row in rows] for rows in (history, again)])
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


def test_mistakes_on_the_command_line_are_one_line_each(tmp_path, dataset):
    out = tmp_path / "out"
    full = tmp_path / "full"
    full.mkdir()
    (full / "diary.txt").write_text("mine")
    lonely = tmp_path / "lonely"
    attempts = synthetic.random_attempts(6, (0.05, 0.02, 0.03), np.random.default_rng(3))
    write_shard(shard_path(lonely, "box", 0), attempts, synthetic.info("box"))
    cases = [
        ((), 2, "--data is needed"),
        (("--data", dataset), 2, "--out is needed"),
        (("--data", tmp_path / "no", "--out", out), 1, "no dataset folder"),
        (("--data", tmp_path, "--out", out), 1, "no shards"),
        (("--data", dataset, "--out", full), 2, "holds no training run"),
        (("--data", lonely, "--out", out), 1, "one part (box)"),
        (("--config", tmp_path / "no.yaml"), 2, "cannot read configuration"),
    ]
    if not torch.cuda.is_available():
        cases.append((("--data", dataset, "--out", out, "--device", "cuda"), 2, "no CUDA device"))
    for arguments, code, words in cases:
        done = run_here(train.main, *map(str, arguments))
        assert done.returncode == code and words in done.stderr, (arguments, done)
        assert done.stderr.count("\n") == 1
    assert not out.exists()


@pytest.mark.parametrize("name", ["default", "pretrained", "paper", "paper_quick"])
def test_the_configurations_that_are_shipped_can_be_read(name):
    config = cli.parse(
        TrainConfig,
        prog="train",
        description="",
        argv=["--config", str(DEFAULT_CONFIG.with_name(f"{name}.yaml")), "--seed", "3"],
    )
    assert config.seed == 3 and config.calibrate == ("paper" not in name)
    assert config.network.architecture == ("patch" if "paper" in name else "hand")
    assert config.network.symmetric_views == ("paper" not in name)
    if "paper" in name:
        assert config.network == PatchNetworkConfig()
    if name == "paper":
        assert config.gqn == StageConfig(
            optimiser="rmsprop",
            learning_rate=1e-5,
            decay=1e-6,
            schedule="constant",
            epochs=100,
            batch_size=32,
        )


def test_parts_outside_the_success_range_are_left_out(dataset):
    samples = read_samples(dataset, SMALL)
    rates = sorted(
        float(samples.success[samples.part == i].float().mean()) for i in range(len(samples.parts))
    )
    middle = rates[len(rates) // 2]
    kept = samples.of_parts_between(0.0, middle)
    assert 0 < len(kept.parts) < len(samples.parts) and len(kept) < len(samples)
    for i, name in enumerate(kept.parts):
        rows = samples.part == samples.parts.index(name)
        assert float(kept.success[kept.part == i].float().mean()) <= middle
        assert torch.equal(kept.patches[kept.part == i], samples.patches[rows])
    with pytest.raises(BadDataset, match="widen success_range"):
        samples.of_parts_between(0.999, 0.9991)


def test_our_network_learns_and_its_intervals_hold_what_they_say(tmp_path):
    dataset = synthetic.write_dataset(tmp_path, n_parts=8, n_attempts=250, seed=1)
    samples = read_samples(dataset, HAND.network)
    assert samples.patches.shape == (2000, 1, 33, 33) and samples.patches.dtype == torch.int16
    rows = torch.tensor([3, 5])
    seen = samples.quality_patches_of(rows, "cpu", HAND.network)
    assert torch.equal(seen, samples.patches_of(rows, "cpu")[..., ::2, 8:25:2])
    models, _ = learn(samples, HAND, checkpoint_path=tmp_path / "checkpoint")
    report, found = models.meta.metrics, models.meta.calibration
    assert report["gqn"]["auroc"] > 0.85
    assert report["gdn"]["translation_rmse"] < 0.6 * report["gdn"]["zero_displacement"]["translation_rmse"]
    # Scaled on these very rows, 90 % of them lie inside.
    assert report["gdn"]["n"] >= 50 and max(found.variance_scale) != 1.0
    assert all(0.87 <= share <= 0.93 for share in report["gdn"]["coverage_90"].values())
    assert found.quality_slope > 0 and min(found.variance_scale) > 0
    save_model(tmp_path / "model", models)
    assert load_models(tmp_path / "model").meta.calibration == found


def test_the_catalogue_decides_the_sides_where_it_is_asked_to(monkeypatch, tmp_path):
    names = tuple(f"part_{k}" for k in range(6))
    with pytest.raises(BadDataset, match="build --catalogue"):
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
        part_sides(names, 0.2, "catalogue")


def test_turned_samples_need_pictures_that_turn(dataset):
    with pytest.raises(ValueError, match="symmetric"):
        LearningConfig(network=PatchNetworkConfig(image="object"), symmetric=True)
    network = SMALL.model_copy(update={"image": "object"})
    samples = read_samples(dataset, network)
    assert samples.object_patches.shape == samples.patches.shape
    config = SHORT.model_copy(update={"network": network, "symmetric": False})
    rows = torch.arange(8)
    stage = Stage("gdn", build_models(describe(samples, split(samples, config).training, config)), samples,
                  split(samples, config), config)  # fmt: skip
    inputs = stage.batch(rows, torch.Generator().manual_seed(0))[0]
    assert inputs.shape == (8, 1, 40, 40)
