"""A simulated cell with a plain box."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from hal.operator import Operator
from hal.sim import SapienCellConfig, sapien_cell
from mskgrasp.trials.engine import TrialEngine
from tests.boxes import make_box
from tests.trials.box_grasps import SIZE, BoxCell


@pytest.fixture(scope="session")
def open_box_cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[BoxCell]:
    """A connected cell with a box that lies flat; it asks nobody."""
    folder = str(make_box(tmp_path_factory.mktemp("box"), "box", SIZE, 0.1).folder)
    cell = sapien_cell(SapienCellConfig(type="sapien", part=folder))
    with cell.connected():
        engine = TrialEngine(
            cell, Operator(cell, yes=True), picture=tmp_path_factory.mktemp("n") / "next.png"
        )
        found = BoxCell(engine=engine, part=folder, seed=0)
        while not found.lies_flat():
            found.seed += 1
        yield found


@pytest.fixture
def box_cell(open_box_cell: BoxCell) -> BoxCell:
    """Without a fault of the test before."""
    open_box_cell.engine.cell.arm.recover()
    return open_box_cell
