"""Settings of a measurement of the table."""

from __future__ import annotations

import pytest

from hal.touch.config import TouchConfig
from mskgrasp.core.config import check_config
from mskgrasp.core.errors import BadConfig


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"force": 0.5}, "'force': input should be greater than or equal to 1"),
        ({"force": 40}, "'force': input should be less than or equal to 15"),
        ({"speed": 0.1}, "'speed': input should be less than or equal to 0.025"),
        ({"search": 0.1}, "'search': input should be less than or equal to 0.03"),
        ({"table_at": 2}, "'table_at': input should be less than or equal to 0.5"),
        ({"flatness": 0}, "'flatness': input should be greater than 0"),
    ],
)
def test_a_wrong_value_is_one_line_that_names_it(values: dict, message: str):
    with pytest.raises(BadConfig) as caught:
        check_config(TouchConfig, {"cell": "cell.yaml", **values}, "touch")
    assert message in str(caught.value) and "\n" not in str(caught.value)
