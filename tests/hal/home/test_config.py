"""Options of homing a hand."""

from __future__ import annotations

import pytest

from hal.home.config import HomeConfig
from mskgrasp.core.config import check_config
from mskgrasp.core.errors import BadConfig


def test_the_operator_is_asked_unless_it_is_told_otherwise():
    assert not check_config(HomeConfig, {"cell": "configs/cells/sapien.yaml"}, "home").yes


@pytest.mark.parametrize(
    ("values", "message"), [({}, "'cell'"), ({"cell": "a", "yes": "perhaps"}, "'yes'"), ({"cel": "a"}, "cel")]
)
def test_a_wrong_value_is_one_line_that_names_it(values: dict, message: str):
    with pytest.raises(BadConfig) as caught:
        check_config(HomeConfig, values, "home")
    assert message in str(caught.value) and "\n" not in str(caught.value)
