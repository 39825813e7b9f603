"""A cell opens both its devices or none."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from hal import Cell
from hal.errors import NotConnected
from tests.hal.test_device import Lamp


@pytest.mark.parametrize("broken", ["camera", "arm"])
def test_a_cell_that_opens_by_half_is_closed_again(broken: str):
    lamps = {name: Lamp(broken=name == broken) for name in ("camera", "arm")}
    workspace = SimpleNamespace()
    cell = Cell(**lamps, workspace=workspace)  # type: ignore[arg-type]
    with pytest.raises(NotConnected), cell.connected():
        pytest.fail("the block ran")
    assert not any(lamp.lit for lamp in lamps.values())
    assert lamps["camera"].log == (["connect"] if broken == "camera" else ["connect", "close"])
    assert lamps["arm"].log == ([] if broken == "camera" else ["connect"])
