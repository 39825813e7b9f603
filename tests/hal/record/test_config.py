"""Options of a recording."""

from __future__ import annotations

import pytest

from hal.record.config import RecordConfig
from mskgrasp.core.config import check_config
from mskgrasp.core.errors import BadConfig

GIVEN = {"cell": "configs/cells/sapien.yaml", "out": "out/cell.h5"}


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"cell": "a.yaml"}, "'out'"),
        (GIVEN | {"frames": 0}, "'frames': input should be greater than or equal to 1"),
        (GIVEN | {"frames": 100_001}, "'frames': input should be less than or equal to 100000"),
        (GIVEN | {"interval": -1}, "'interval': input should be greater than or equal to 0"),
        (GIVEN | {"interval": 3601}, "'interval': input should be less than or equal to 3600"),
    ],
)
def test_a_wrong_value_is_one_line_that_names_it(values: dict, message: str):
    with pytest.raises(BadConfig) as caught:
        check_config(RecordConfig, values, "record")
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_the_bounds_themselves_are_allowed():
    longest = check_config(RecordConfig, GIVEN | {"frames": 100_000, "interval": 3600}, "record")
    assert longest.frames == 100_000 and longest.interval == 3600
