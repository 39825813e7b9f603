"""Settings of the simulated cell that are refused."""

from __future__ import annotations

from typing import Any

import pytest

from hal.sim import SapienCellConfig
from mskgrasp.core.config import check_config
from mskgrasp.core.errors import BadConfig


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"region": [0.7, 0.9, -0.1, 0.1]}, "region [0.7, 0.9, -0.1, 0.1] reaches beyond the arm"),
        ({"region": [0.62, 0.38, -0.12, 0.12]}, "region must be x_min < x_max"),
        ({"camera": {"height": 0.4}}, "the camera sees 0.18 m of the table"),  # 160 px * 0.4 m / 365.5 px
        ({"colour_scale": 7}, "'colour_scale': input should be less than or equal to 6"),
        ({"lift_height": 0.4}, "'lift_height': input should be less than or equal to 0.3"),
        ({"home": [0.0] * 6}, "'home': 7 values are needed, got 6"),
    ],
)
def test_a_wrong_value_is_one_line_that_names_it(values: dict[str, Any], message: str):
    with pytest.raises(BadConfig) as caught:
        check_config(SapienCellConfig, {"type": "sapien", **values}, "cell.yaml")
    assert message in str(caught.value) and "\n" not in str(caught.value)
