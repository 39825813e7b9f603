"""Trials of an experiment, the models that it compares, and their predictions for stored trials."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.errors import UsageError
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.evaluate.experiments import (
    load_compared,
    model_folders,
    own_choices,
    scenes,
    with_predictions,
)
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts import find_part
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.trials.predictors import LOWESS, NetworkPredictor
from mskgrasp.trials.trial_files import trial_file, write_trial
from tests.evaluate.made_trials import trial
from tests.planning.hand_made import FRAME, planner

PART = "parallel_key_a16x10x56"


def test_labels_and_folders_are_those_given_or_the_runs_own_model():
    own = Path("models/gcip_mv")
    assert model_folders(["a=x", "B+V.2=y=z"], own) == {"a": Path("x"), "B+V.2": Path("y=z")}
    assert model_folders([], own) == {"gcip_mv": own}
    # A folder whose name is no label, as its hyphen would separate the trial's number.
    assert model_folders([], Path("models/gcip-mv")) == {"model": Path("models/gcip-mv")}
    assert model_folders([], Path("models/LOWESS")) == {"model": Path("models/LOWESS")}


@pytest.mark.parametrize("text", ["", "a", "a=", "=x", "1a=x", "a-b=x", "a b=x", "lowess=x", "LOWESS=x"])
def test_what_is_no_label_and_folder_is_refused_with_an_example(text: str):
    with pytest.raises(UsageError, match="give label=folder, for example gcip_mv=models/gcip_mv") as raised:
        model_folders([text], PRETRAINED)
    assert repr(text) in str(raised.value)


def test_a_label_is_given_once():
    with pytest.raises(UsageError, match="two models are called 'a'"):
        model_folders(["a=x", "b=y", "a=z"], PRETRAINED)


def test_trials_of_one_part_and_number_share_a_scene_and_parts_come_in_turn():
    parts = {"nut": "nut", "bolt": "folders/bolt"}
    found = scenes(parts, 2, 7, PlannerConfig(policy="low_variance"), None)
    assert [[task.key for task in scene] for scene in found] == [
        ["nut-000"], ["bolt-000"], ["nut-001"], ["bolt-001"],
    ]  # fmt: skip
    assert found[1][0].source == "folders/bolt"
    assert {(task.seed, task.policy, task.chosen_by) for scene in found for task in scene} == {
        (7, "low_variance", "")
    }


@pytest.fixture(scope="module")
def compared(collected: Path):
    hashes = {name: find_part(name).content_hash for name in (PART, "washer_m36")}
    return load_compared([f"net={PRETRAINED}"], PRETRAINED, collected, hashes, 640)


def test_every_model_with_variances_chooses_two_more_grasps_in_a_scene_and_lowess_of_parts_it_knows(compared):
    (known,) = scenes({PART: PART}, 1, 0, PlannerConfig(policy="low_variance"), compared)
    assert [(task.policy, task.chosen_by) for task in known] == [
        ("quality", ""), ("low_variance", "net"), ("recentred", "net"),
        ("low_variance", LOWESS), ("recentred", LOWESS),
    ]  # fmt: skip
    assert [task.key for task in known][:3] == [f"{PART}-000", f"{PART}-000-net", f"{PART}-000-net-recentred"]
    as_paper = PlannerConfig(policy="low_variance", recentre=False)
    (plain,) = scenes({PART: PART}, 1, 0, as_paper, compared)
    assert plain == tuple(task for task in known if task.policy != "recentred")
    (novel,) = scenes({"washer_m36": "washer_m36"}, 1, 0, PlannerConfig(), compared)
    assert [task.chosen_by for task in novel] == ["", "net", "net"]
    assert compared.lowess is not None and compared.choosers == ["net"]


def test_a_model_may_choose_grasps_of_its_own_in_the_first_trials_alone(compared):
    chooses = own_choices(["lowess=1", "net=2"], compared)
    found = scenes({PART: PART}, 3, 0, PlannerConfig(), compared, chooses)
    each = [[task.chosen_by for task in scene if task.policy != "recentred"] for scene in found]
    assert each == [["", "net", LOWESS], ["", "net"], [""]]
    # Of a larger run with the same scenes, they are the same trials.
    assert found[0] == scenes({PART: PART}, 1, 0, PlannerConfig(), compared)[0]


@pytest.mark.parametrize("text", ["net", "net=", "net=-1", "net=1.5", "other=3"])
def test_who_chooses_in_how_many_trials_is_a_label_and_a_number(text: str, compared):
    with pytest.raises(UsageError, match="give label=number once a model, for example net=7"):
        own_choices([text], compared)


def test_the_grasps_that_lowess_is_fitted_to_are_an_input_of_the_run(compared):
    assert set(compared.inputs) == {
        "model net: model.json", "model net: model.safetensors", f"grasps of {PART} for LOWESS",
    }  # fmt: skip


def test_a_dataset_of_other_parts_is_refused(collected: Path):
    with pytest.raises(UsageError, match="holds successful grasps of none of the parts"):
        load_compared([], PRETRAINED, collected, {"washer_m36": find_part("washer_m36").content_hash}, 640)


def test_a_prediction_added_later_is_the_one_that_planned_the_trial(tmp_path: Path):
    models = load_models(PRETRAINED)
    plan = planner(PlannerConfig(n_candidates=50), models).plan(FRAME, np.random.default_rng(0))
    point = plan.view.centre_base
    mean, covariance = plan.displacement_of(point)
    one = trial(point_base=point.tolist(), measured=[0.0, 0.001, 0.0, 0.0], pose_base_obj=None)
    write_trial(trial_file(tmp_path, one.key), FRAME, plan, None)
    more = with_predictions(one, tmp_path, {"net": NetworkPredictor(models, 640)})
    # The file holds depths rounded to 0.1 mm, and the plan's view.
    np.testing.assert_allclose(more.predictions["net"].mean, mean, atol=2e-4)
    np.testing.assert_allclose(more.predictions["net"].std, np.sqrt(np.diag(covariance)), rtol=0.1)
    assert with_predictions(more, tmp_path / "gone", {"net": NetworkPredictor(models, 640)}) is more


def test_trials_without_a_measurement_or_chosen_by_a_variance_get_no_predictions(tmp_path: Path):
    predictors = {"net": NetworkPredictor(load_models(PRETRAINED), 640)}
    for one in (trial(measured=None), trial(point_base=None), trial(chosen_by="net")):
        assert with_predictions(one, tmp_path, predictors) is one
