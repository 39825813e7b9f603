from __future__ import annotations

from collections.abc import Iterator

import pytest

from hal.sim import SapienCellConfig, sapien_cell
from hal.sim.world import SapienWorld
from mskgrasp.parts import Part
from tests.boxes import make_box


@pytest.fixture(scope="session")
def block(tmp_path_factory: pytest.TempPathFactory) -> Part:
    """4 x 2 x 3 cm, 100 g."""
    return make_box(tmp_path_factory.mktemp("block"), "block", (0.04, 0.02, 0.03), 0.1)


@pytest.fixture(scope="session")
def block_world(block: Part) -> Iterator[SapienWorld]:
    """An open world with the block, whose camera has three pixels of colour along a pixel of depth."""
    cell = sapien_cell(SapienCellConfig(type="sapien", part=str(block.folder), colour_scale=3))
    world = cell.feeder
    assert isinstance(world, SapienWorld)
    with cell.camera:
        yield world
