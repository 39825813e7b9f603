"""The comparison of models, on boxes whose displacements follow from plane geometry."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace

import numpy as np
import pytest
import torch

from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.network_config import PatchNetworkConfig
from tests.benchmarks import models
from tests.benchmarks.choice import Choice, Looks
from tests.benchmarks.conftest import Boxes
from tests.benchmarks.models import Groups, compare
from tests.benchmarks.paper_choices import OURS, PAPER, PAPER_AS_OURS, paper_choices, with_stages
from tests.programs import run_here


@pytest.fixture
def groups(boxes: Boxes) -> Groups:
    config = paper_choices(1)[0].config
    samples = Looks(boxes.data, (0.0, 1.0)).of(config.network)
    return Groups.of(samples, config, novel="test", n_known=4)


def test_what_is_measured_is_not_trained_on(boxes, groups):
    samples = Looks(boxes.data, (0.0, 1.0)).of(paper_choices(1)[-1].config.network)
    training, validation = groups.sides.training, groups.sides.validation
    for measured in (groups.known, groups.novel):
        assert len(measured) and not torch.isin(measured, torch.cat([training, validation])).any()
    # Known parts are trained on, with other grasps; novel ones are not.
    assert torch.isin(samples.part[groups.known], samples.part[training]).all()
    assert not torch.isin(samples.part[groups.novel], samples.part[training]).any()
    assert {samples.parts[number] for number in samples.part[groups.novel].tolist()} == {"box_7"}


def test_pooling_takes_about_as_many_grasps_of_each_part(boxes, groups):
    samples = Looks(boxes.data, (0.0, 1.0)).of(paper_choices(1)[-1].config.network)
    counts = torch.bincount(samples.part[groups.pooled])
    assert int(counts[counts > 0].max()) - int(counts[counts > 0].min()) <= 1


def test_all_models_stop_and_select_alike_and_the_papers_keep_their_own_recipe():
    choices = {one.name: one for one in paper_choices(7)}
    theirs = [PAPER, "GCIP-M", "OCFI-M+V", "OCFI-M"]
    assert list(choices) == [*theirs, *(f"{name}, our recipe" for name in theirs), OURS]
    for one in choices.values():
        config = one.config
        assert (config.gqn.patience, config.gdn.patience, config.keep_best) == (7, 7, True)
        assert config.success_range == (0.05, 0.40) and config.sides == "catalogue"
    ours = choices[OURS].config
    for name in theirs:
        config, recipe = choices[name].config, choices[f"{name}, our recipe"].config
        sees_grasp = name.startswith("GCIP")
        for network in (config.network, recipe.network):
            assert isinstance(network, PatchNetworkConfig)
            assert network.image == ("grasp" if sees_grasp else "object")
            assert network.variance == name.endswith("V")
        assert recipe.network.symmetric_views == sees_grasp
        assert recipe.model_copy(update={"network": ours.network, "symmetric": True}) == ours
        assert LearningConfig.model_validate(recipe.model_dump()) == recipe  # a legal one
        assert (config.gdn.optimiser, config.gdn.learning_rate, config.gdn.epochs) == ("rmsprop", 1e-5, 100)
        assert not config.calibrate and not config.symmetric
    fast = paper_choices(7, mixed_precision=True)
    assert [one.config.mixed_precision for one in fast] == 8 * [True] + [False]
    alone = paper_choices(7, displacement_only=True)
    assert {one.name: one.config for one in alone} == {name: one.config for name, one in choices.items()}
    assert [one.name for one in alone if one.has_quality] == [PAPER_AS_OURS, OURS]
    assert {one.quality_of for one in alone if not one.has_quality} == {PAPER_AS_OURS} == {alone[0].name}


def test_a_share_of_the_attempts_leaves_what_is_measured_alone(boxes, groups):
    config = paper_choices(1)[0].config
    samples = Looks(boxes.data, (0.0, 1.0)).of(config.network)
    half = Groups.of(samples, config, novel="test", n_known=4, share=0.5)
    assert torch.equal(half.known, groups.known) and torch.equal(half.novel, groups.novel)
    for some, every in (
        (half.sides.training, groups.sides.training), (half.sides.validation, groups.sides.validation),
    ):  # fmt: skip
        assert len(some) == round(len(every) / 2) and bool(torch.isin(some, every).all())
    measured = Groups.of(samples, config, novel="validation", n_known=4, share=0.5).novel
    assert torch.equal(measured, groups.sides.validation)


def small(choice: Choice, epochs: int) -> Choice:
    """A choice with a narrow network that learns in seconds."""
    network = choice.config.network.model_copy(
        update={"trunk_width": 32, "action_width": 32, "head_width": 32, "dropout": 0.0}
    )
    if isinstance(network, PatchNetworkConfig):
        network = network.model_copy(update={"channels": 4, "patch_pixels": 32})
    config = with_stages(
        choice.config, epochs=epochs, optimiser="adam", learning_rate=4e-3, batch_size=16
    ).model_copy(update={"network": network, "noise_std": 0.0, "success_range": (0.0, 1.0)})
    return replace(choice, config=config)


@pytest.fixture
def choices() -> list[Choice]:
    by_name = {one.name: one for one in paper_choices(20)}
    return [small(by_name[PAPER], 2), small(by_name["OCFI-M"], 2), small(by_name[OURS], 12)]


def compared(boxes: Boxes, groups: Groups, choices: list[Choice], out, seeds: int):
    looks = Looks(boxes.data, (0.0, 1.0))
    return compare(
        choices, looks=looks, groups=groups, novel="test", seeds=seeds, out=out,
        lowess_data=boxes.data,
        measure_s=0.02,
    )  # fmt: skip


@pytest.mark.slow
def test_the_tables_are_made_from_nothing_and_a_stored_training_is_not_made_again(
    boxes, groups, choices, tmp_path
):
    tables, scores = compared(boxes, groups, choices, tmp_path, 1)
    made = {
        path: path.stat().st_mtime_ns
        for path in tmp_path.rglob("*")
        if path.suffix in (".npz", ".safetensors")
    }
    assert len(made) == 3 * 3  # both groups' predictions and the weights, of each network
    names = [PAPER, "OCFI-M", OURS, "predicting zero"]
    assert list(scores["novel"]) == names and list(scores["known"]) == ["LOWESS", *names]
    assert (
        scores["novel"][OURS]["translation"]["mean"]
        < scores["novel"]["predicting zero"]["translation"]["mean"]
    )
    assert scores["novel"]["OCFI-M"]["coverage"] is None and scores["novel"][OURS]["coverage"]
    assert scores["novel"]["OCFI-M"]["balanced_accuracy"] is None  # its quality network is the other's
    low, high = scores["known"][OURS]["rotation"]["interval"]
    assert low <= scores["known"][OURS]["rotation"]["mean"] <= high
    assert [row[0] for row in tables[-1].rows] == ["OCFI-M", OURS]
    again, same = compared(boxes, groups, choices, tmp_path, 1)
    assert same == scores and again == tables
    assert made == {path: path.stat().st_mtime_ns for path in made}
    _, both = compared(boxes, groups, choices[:1], tmp_path, 2)
    assert both["novel"][PAPER]["translation"]["deviation"] > 0
    assert made == {path: path.stat().st_mtime_ns for path in made}


@pytest.mark.slow
def test_the_papers_recipe_may_have_fewer_seeds_than_ours(boxes, groups, tmp_path):
    by_name = {one.name: one for one in paper_choices(20, paper_seeds=1)}
    some = [small(by_name[PAPER], 1), small(by_name[PAPER_AS_OURS], 1), small(by_name[OURS], 1)]
    tables, scores = compared(boxes, groups, some, tmp_path, 2)
    deviation = {name: one["translation"]["deviation"] for name, one in scores["novel"].items()}
    assert deviation[PAPER] == 0 < deviation[OURS]
    against = {table.caption: [row[0] for row in table.rows] for table in tables[-2:]}
    title = "Change of the error on novel parts relative to "
    assert against == {title + PAPER: [PAPER_AS_OURS, OURS], title + PAPER_AS_OURS: [PAPER, OURS]}


@pytest.mark.slow
def test_the_command_runs_from_a_dataset_to_a_report(boxes, tmp_path):
    done = run_here(
        models.main, "--data", str(boxes.data), "--out", str(tmp_path), "--quick", "--only", PAPER_AS_OURS,
        OURS, "--known-parts", "2",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "report.json").read_text())
    assert (
        report["quick"]
        and report["seeds"] == {PAPER_AS_OURS: 1, OURS: 1}
        and "test_parts_logged" not in report
    )
    assert set(report["scores"]) == {"known", "novel", "pooled"}
    assert (tmp_path / "report.md").read_text().count("| **ours** |") == 3
    assert len((tmp_path / "known_parts.txt").read_text().split()) == 2


def test_what_cannot_be_is_refused_in_one_line(boxes, tmp_path):
    base = ("--data", str(boxes.data), "--out", str(tmp_path / "out"))
    done = run_here(models.main, *base, "--only", "GCIP")
    assert done.returncode == 2 and "--only GCIP; legal: GCIP-M+V," in done.stderr
    done = run_here(models.main, *base, "--quick", "--split", "test")
    assert done.returncode == 2 and "leave out --split test" in done.stderr


def test_a_use_of_the_test_parts_is_logged_with_its_figures(tmp_path, monkeypatch):
    log = tmp_path / "test_parts.csv"
    monkeypatch.setattr("tests.docs.uses_of_test_parts.TEST_PARTS", log)
    monkeypatch.setattr("sys.argv", ["models", "--only", PAPER_AS_OURS, "--out", str(tmp_path)])
    error = {"translation": {"mean": 0.0042}, "rotation": {"mean": np.pi / 36}}
    models.log_test_parts(170, {OURS: error, PAPER: error}, tmp_path)
    (row,) = csv.reader(log.read_text().splitlines())
    assert row[2:] == [
        "python -m tests.benchmarks.models --only 'GCIP-M+V, our recipe'",
        "test: 170 held-out parts of the catalogue",
        "ours 4.2 mm, 5.0 degrees; GCIP-M+V 4.2 mm, 5.0 degrees",
    ]
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", row[0]) and re.match(r"[0-9a-f]{7}", row[1])
