"""Records of trials: their names, and their way into a file and back."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hal.errors import OutOfWorkspace
from mskgrasp.core.errors import NoPartFound
from mskgrasp.trials.trial import Prediction, Trial, reason_of, trial_key
from tests.evaluate.made_trials import NOTHING, trial

number = st.floats(-10, 10)
vector = st.lists(number, min_size=4, max_size=4)
maybe_nan = st.lists(st.one_of(number, st.just(float("nan"))), min_size=4, max_size=4)


@given(
    measured=st.none() | maybe_nan, predicted=vector, std=maybe_nan, other=maybe_nan, success=st.booleans()
)
def test_a_trial_is_read_back_equal_from_strict_json(measured, predicted, std, other, success):
    one = trial(
        measured=measured, predicted=predicted, predicted_std=std, success=success,
        predictions={"net": Prediction(mean=predicted, std=other)},
    )  # fmt: skip
    again = Trial.from_json(json.loads(json.dumps(one.to_json(), allow_nan=False)))
    # NaN differs from itself: compared in text, where it is written.
    assert repr(again) == repr(one) and again.key == one.key


def test_a_trial_without_a_grasp_keeps_its_gaps():
    one = trial(**NOTHING, point_base=None)
    again = Trial.from_json(json.loads(json.dumps(one.to_json())))
    assert again == one and again.predicted_std is None and again.predictions == {}


def test_the_name_counts_the_trial_and_tells_who_chose_its_grasp():
    assert trial_key("nut", 1234, "gcip_mv", "recentred") == "nut-1234-gcip_mv-recentred"
    assert trial(number=7, chosen_by="net").key == "a-007-net"
    assert trial().key == trial_key("a", 0, "", "quality") == "a-000"


@pytest.mark.parametrize("part", ["", "../x", "a/b", ".hidden", "-x", "a b", "a\n", "ü"])
def test_a_name_that_is_no_files_name_is_refused(part: str):
    with pytest.raises(ValueError):
        Trial.from_json(trial().to_json() | {"part": part})


@pytest.mark.parametrize(
    ("changes", "missing"),
    [
        ({}, "point_base"),  # written by versions that predicted one point and measured another
        ({}, "predicted_std"),
        ({}, "part"),
        ({"colour": "red"}, ""),
        ({"predictions": {"net": {"mean": [0.0] * 4}}}, ""),
        ({"predicted_std": 3}, ""),
    ],
)
def test_values_of_another_kind_are_no_trial(changes: dict, missing: str):
    values = trial().to_json() | changes
    values.pop(missing, None)
    with pytest.raises((TypeError, ValueError, KeyError)):
        Trial.from_json(values)


def test_unknown_deviations_are_null_in_the_file_and_nan_in_the_record():
    one = dataclasses.replace(trial(), predicted_std=[np.nan] * 4, measured=[0.1, 0.2, np.nan, 0.3])
    values = one.to_json()
    assert values["predicted_std"] == [None] * 4 and values["measured"] == [0.1, 0.2, None, 0.3]
    again = Trial.from_json(values)
    assert again.measured is not None and np.isnan(again.measured[2]) and again.measured[3] == 0.3


def test_the_reason_of_an_error_is_in_words():
    assert [reason_of(one) for one in (NoPartFound, OutOfWorkspace)] == ["no part found", "out of workspace"]
