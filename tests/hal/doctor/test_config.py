"""Options of a diagnosis."""

from __future__ import annotations

from pathlib import Path

import pytest

from hal.doctor.config import DoctorConfig
from mskgrasp.core.config import check_config
from mskgrasp.core.errors import BadConfig


def test_nothing_moves_unless_it_is_asked_for():
    assert not check_config(DoctorConfig, {"cell": "configs/cells/sapien.yaml"}, "doctor").move


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, "'cell'"),
        ({"cell": "a.yaml", "move": "perhaps"}, "'move'"),
        ({"cell": "a.yaml", "moves": True}, "unknown key 'moves'"),
    ],
)
def test_a_wrong_value_is_one_line_that_names_it(values: dict, message: str):
    with pytest.raises(BadConfig) as caught:
        check_config(DoctorConfig, values, "doctor")
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_the_cell_is_a_path():
    assert check_config(DoctorConfig, {"cell": "a/b.yaml"}, "doctor").cell == Path("a/b.yaml")
