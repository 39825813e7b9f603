"""Settings of an evaluation."""

from __future__ import annotations

import pytest

from mskgrasp.core.errors import BadConfig
from mskgrasp.evaluate.config import EvaluateConfig


def test_models_to_compare_can_be_a_mapping_in_a_file():
    named = EvaluateConfig.model_validate(dict(models="m", compare={"gcip_mv": "models/a"}))
    assert named.compare == ("gcip_mv=models/a",)
    with pytest.raises((BadConfig, ValueError)):
        EvaluateConfig.model_validate(dict(models="m", compare=[1]))
