"""Settings of an evaluation."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from mskgrasp.core.config import read_config
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.shipped import config_file
from mskgrasp.evaluate.config import EvaluateConfig


def test_models_to_compare_can_be_a_mapping_in_a_file():
    named = EvaluateConfig.model_validate(dict(models="m", compare={"gcip_mv": "models/a"}))
    assert named.compare == ("gcip_mv=models/a",)
    fewer = EvaluateConfig.model_validate(dict(chooses={"lowess": 7}))
    assert fewer.chooses == ("lowess=7",)
    with pytest.raises((BadConfig, ValueError)):
        EvaluateConfig.model_validate(dict(models="m", compare=[1]))


@pytest.mark.parametrize("path", sorted(config_file("evaluate").glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_settings_name_their_experiment(path):
    assert read_config(EvaluateConfig, path).experiment == path.stem


@pytest.mark.parametrize(
    "values", [dict(experiment="speed"), dict(trials=0), dict(measure="eye"), dict(tape=(0.01,)), dict(n=1)]
)
def test_what_cannot_be_run_is_refused(values):
    with pytest.raises(ValidationError):
        EvaluateConfig.model_validate(values)
