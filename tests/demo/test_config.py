"""Settings of the first grasp."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError

from mskgrasp.demo.config import DemoConfig


def test_the_example_ships_and_a_seed_is_not_negative():
    assert Path(DemoConfig().part).is_file()
    with pytest.raises(ValidationError):
        DemoConfig(seed=-1)
