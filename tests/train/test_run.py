import csv
import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from mskgrasp.core.config import read_config
from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.core.files import exclusive_lock
from mskgrasp.core.grasp import FAILURES
from mskgrasp.dataset import list_shards, read_shard, shard_path, write_shard
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.learning.sides import split
from mskgrasp.train import run as train
from mskgrasp.train.__main__ import main
from mskgrasp.train.config import TrainConfig
from tests import synthetic
from tests.learning.small import PATCH, SHORT
from tests.programs import run_here


def program(config: LearningConfig, **changes) -> TrainConfig:
    return TrainConfig(**(config.model_dump() | {"device": "cpu"} | changes))


@pytest.mark.slow
def test_one_number_of_epochs_stands_for_all_networks_and_is_what_a_stopped_run_needs(dataset, tmp_path):
    out = tmp_path / "model"
    config = SHORT
    assert train.run_training(program(config, data=dataset, out=out, epochs=1)) == 0
    with open(out / "log.csv") as file:
        assert [row["stage"] for row in csv.DictReader(file)] == ["gqn", "gdn"]
    kept = read_config(TrainConfig, out / "config.yaml")
    assert kept.gqn.epochs == kept.gdn.epochs == 1
    assert train.run_training(program(config, data=dataset, out=out, epochs=1)) == 0
    with pytest.raises(UsageError, match="gdn"):
        train.run_training(program(config, data=dataset, out=out))


def test_a_small_dataset_is_learned_and_every_file_of_a_model_is_written(dataset, tmp_path):
    out = tmp_path / "model"
    config = PATCH.model_copy(update={"validation_fraction": 0.4})  # one part alone has no interval
    assert train.run_training(program(config, data=dataset, out=out)) == 0
    report = json.loads((out / "metrics.json").read_text())
    gqn, gdn = report["gqn"], report["gdn"]
    assert gqn["auroc"] > 0.85
    assert gqn["brier"] < 0.6 * gqn["brier_of_base_rate"]
    for constant in ("zero_displacement", "training_mean"):
        # Some 130 successes teach such a small network the shift; the turn takes thousands.
        assert gdn["translation_rmse"] < 0.35 * gdn[constant]["translation_rmse"]
        assert gdn["nll"] < gdn[constant]["nll"] - 0.5
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
        ".lock",
        "uncertainty.png",
        "log.csv",
        "curves.png",
        "config.yaml",
    }
    # Started again, there is nothing to do; with other settings, the folder is taken.
    assert train.run_training(program(config, data=dataset, out=out)) == 0
    with pytest.raises(UsageError, match=r"other settings \(seed\)"):
        train.run_training(program(config, data=dataset, out=out, seed=1))


@pytest.mark.slow
def test_a_finished_training_is_not_taken_for_that_of_other_data(dataset, tmp_path, capsys):
    out, other = tmp_path / "model", tmp_path / "other"
    few = program(SHORT, data=dataset, out=out, epochs=1)
    assert train.run_training(few) == 0
    assert "warning: 560 attempts at 7 parts are few to learn from" in capsys.readouterr().err
    (out / "checkpoint.safetensors").touch()  # a kill after the model was written leaves it
    assert train.run_training(few) == 0
    assert "trained already" in capsys.readouterr().out and not (out / "checkpoint.safetensors").exists()
    synthetic.write_dataset(other, n_parts=8, n_attempts=80, seed=2)
    with pytest.raises(UsageError, match="trained on other data"):
        train.run_training(few.model_copy(update={"data": other}))


def planned_boxes(folder: Path, n_parts: int = 8, **changes: Any) -> Path:
    """A dataset of boxes as if a planner had chosen its grasps."""
    synthetic.write_dataset(folder, n_parts=n_parts, n_attempts=10, seed=3)
    for path in list_shards(folder):
        attempts, info = read_shard(path)
        write_shard(path, attempts, dataclasses.replace(info, **({"planner": "0123"} | changes)))
    return folder


@pytest.mark.parametrize(
    ("swap", "changes", "message"),
    [
        (True, {}, "holds grasps that a planner chose: name it with --planned, random ones with --data"),
        (
            False,
            {"planner": ""},
            "holds random grasps: name it with --data, planned ones with --planned",
        ),
        (False, {"fidelity": "gpu"}, "was simulated otherwise than the random grasps: .*fidelity gpu"),
        (False, {"noise": {"friction_pad_part": [0.3, 0.8]}}, "friction_pad_part 0.3 to 0.8"),
    ],
)
def test_datasets_that_do_not_belong_together_are_not_learned(dataset, tmp_path, swap, changes, message):
    pair = dataset, planned_boxes(tmp_path / "planned", **changes)
    data, planned = pair[::-1] if swap else pair
    with pytest.raises(BadDataset, match=message):
        train.run_training(program(SHORT, data=data, planned=(planned,), out=tmp_path / "model", epochs=1))
    assert not (tmp_path / "model").exists()


@pytest.mark.slow
def test_uncertainty_is_drawn_where_planned_grasps_alone_succeed_at_the_held_out_parts(
    dataset, tmp_path, monkeypatch
):
    read = train._read

    def without_random_successes(config, data):
        samples = read(config, data)
        held_out = torch.isin(torch.arange(len(samples)), split(samples, config).validation)
        return dataclasses.replace(samples, success=samples.success & (samples.planned | ~held_out))

    monkeypatch.setattr(train, "_read", without_random_successes)
    planned, out = planned_boxes(tmp_path / "planned"), tmp_path / "model"
    assert train.run_training(program(SHORT, data=dataset, planned=(planned,), out=out, epochs=1)) == 0
    assert (out / "uncertainty.png").exists() and (out / "model.json").exists()


def test_planned_grasps_are_learned_beside_random_ones_and_named_in_the_model(dataset, tmp_path):
    planned, out = planned_boxes(tmp_path / "planned"), tmp_path / "model"
    both = program(SHORT, data=dataset, planned=(planned,), out=out, epochs=1)
    assert train.run_training(both) == 0
    meta = load_models(out).meta
    assert meta.training["attempts"] == 7 * (80 + 10)
    assert {source.planner for source in meta.labels} == {"", "0123"}
    assert "grasps chosen by a planner" in (out / "card.md").read_text()
    assert meta.metrics["gqn"]["n"] == 80  # random ones alone
    assert train.run_training(both) == 0  # finished, and of the same data
    with pytest.raises(BadDataset, match="planner and seed of another --planned dataset; name each once"):
        train.run_training(both.model_copy(update={"planned": (planned, planned), "out": tmp_path / "twice"}))
    with pytest.raises(UsageError, match=f"trained on other data than {dataset}; choose"):
        train.run_training(both.model_copy(update={"planned": ()}))


def test_a_checkpoint_of_other_data_keeps_the_settings_that_go_on_with_it(dataset, tmp_path, monkeypatch):
    out, other = tmp_path / "model", tmp_path / "other"
    few = program(SHORT, data=dataset, out=out, epochs=1)

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(train._ProgressBar, "epoch", interrupted)
        train.run_training(few)
    before = (out / "config.yaml").read_bytes()
    synthetic.write_dataset(other, n_parts=8, n_attempts=80, seed=2)
    with pytest.raises(UsageError, match="made from other data"):
        train.run_training(few.model_copy(update={"data": other}))
    assert (out / "config.yaml").read_bytes() == before


@pytest.mark.slow
def test_a_training_that_was_killed_as_it_began_begins_again(dataset, tmp_path):
    out = tmp_path / "model"
    out.mkdir()
    (out / "config.yaml.0123.tmp").touch()
    assert train.run_training(program(SHORT, data=dataset, out=out, epochs=1)) == 0


def test_two_trainings_do_not_write_into_one_folder(dataset, tmp_path):
    out = tmp_path / "model"
    out.mkdir()
    with exclusive_lock(out), pytest.raises(UsageError, match="another training is writing into"):
        train.run_training(program(SHORT, data=dataset, out=out, epochs=1))
    assert [path.name for path in out.iterdir()] == [".lock"]


def test_a_success_range_that_leaves_one_part_names_it(dataset, tmp_path):
    won = {}
    for attempts, info in map(read_shard, list_shards(dataset)):
        won.setdefault(info.part, []).extend(attempts.success)
    best = max(won, key=lambda part: np.mean(won[part]))
    least = float(np.mean(won[best]))
    config = program(SHORT, data=dataset, out=tmp_path / "model", success_range=(least - 1e-6, 1.0))
    with pytest.raises(
        BadDataset, match=f"of the 8 parts only {best} has a success in .*; widen success_range"
    ):
        train.run_training(config)


def test_a_part_without_a_usable_attempt_is_named_and_the_success_range_is_not_blamed(tmp_path):
    data = synthetic.write_dataset(tmp_path / "data", n_parts=2, n_attempts=20, seed=1)
    path = shard_path(data, "box_1", 0)
    attempts, info = read_shard(path)
    nobody = dataclasses.replace(
        attempts,
        success=np.zeros_like(attempts.success),
        failure=np.full_like(attempts.failure, FAILURES.index("unsettled")),
        displacement=np.full_like(attempts.displacement, np.nan),
    )
    write_shard(path, nobody, info)
    words = r"only box_0 has usable attempts, .* box_1 is usable \(the part was not at rest\): collect more"
    with pytest.raises(BadDataset, match=words):
        train.run_training(program(SHORT, data=data, out=tmp_path / "model"))


def test_a_folder_of_another_programs_run_is_refused_by_that_name(dataset, tmp_path):
    (tmp_path / "config.yaml").write_text("parts: [starter]\n")
    with pytest.raises(UsageError, match=r"another program's run \(.*'parts'.*; choose another --out"):
        train.run_training(program(SHORT, data=dataset, out=tmp_path))


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
        (("--data", tmp_path / "no", "--out", out), 2, "no dataset folder"),
        (("--data", tmp_path, "--out", out), 2, "no shards"),
        (("--data", dataset, "--out", full), 2, "holds no training run"),
        (("--data", lonely, "--out", out), 1, "one part (box)"),
        (("--config", tmp_path / "no.yaml"), 2, "cannot read configuration"),
    ]
    if not torch.cuda.is_available():
        cases.append((("--data", dataset, "--out", out, "--device", "cuda"), 2, "no CUDA device"))
    for arguments, code, words in cases:
        done = run_here(main, *map(str, arguments))
        assert done.returncode == code and words in done.stderr, (arguments, done)
        assert done.stderr.count("\n") == 1
    assert not out.exists()
