"""All that is stored of a comparison of settings, of made-up outcomes."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mskgrasp.core.settings import Physics
from mskgrasp.validate.config import DRAWN, NOMINAL, ValidateConfig
from mskgrasp.validate.convergence import Convergence, measure_convergence
from mskgrasp.validate.outcomes import Outcomes
from tests.validate.made_up import moved, outcomes

CONFIG = ValidateConfig(
    grasps_per_part=40, variant_grasps_per_part=40, variants={"hulls": {"exact": {"hulls": "exact"}}},
    ranges={"finger_force": (20.0, 40.0)},
)  # fmt: skip


def measured(config: ValidateConfig, **changes: Outcomes) -> Convergence:
    same, noise = outcomes(40), np.random.default_rng(1).normal(0, 5e-5, (800, 4))
    found = {
        one.name: moved(same, noise) if one.shift else changes.get(one.name, same)
        for one in config.settings()
    }
    return measure_convergence(config, found)


def test_production_that_equals_its_references_fails_nothing():
    found = measured(CONFIG)
    assert found.production == CONFIG.production and found.yardstick == CONFIG.references[0].name
    assert {one.setting for one in found.grid} == set(CONFIG.candidates())
    assert found.choice.shown and found.choice.production_fails == []
    assert found.impossible.attempts == found.size.n == 800


def test_production_at_a_rate_at_which_no_data_is_collected_is_judged_too():
    found = measured(CONFIG.model_copy(update={"physics": Physics(rate_hz=200)}))
    assert found.production == "200 Hz, 50 it" in {one.setting for one in found.grid}


def test_production_that_is_off_says_by_how_much():
    off = {NOMINAL: moved(outcomes(40), np.array([1e-3, 0, 0, 0]))}
    (said,) = measured(CONFIG, **off).choice.production_fails
    assert said.startswith("median displacement beyond the floor: +0.9")


def test_it_is_stored_as_plain_values_and_without_ranges_has_no_error_of_a_label():
    drawn = {DRAWN: moved(outcomes(40), np.array([0, 1e-3, 0, 0]))}
    stored = json.loads(json.dumps(measured(CONFIG, **drawn).to_json(), allow_nan=False))
    assert list(stored) == [
        "production", "yardstick", "size", "errors", "grid", "choice", "sensitivity", "label_error",
        "impossible",
    ]  # fmt: skip
    assert stored["choice"] == {
        "setting": stored["grid"][0]["setting"], "shown": True, "production_fails": []
    }  # fmt: skip
    assert stored["label_error"]["shift_median"] == pytest.approx(1e-3)
    bare = CONFIG.model_copy(update={"ranges": {}})
    assert measured(bare).to_json()["label_error"] is None
