from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from hal import Cell, cell_from_yaml

CELLS = Path(__file__).parents[2] / "configs" / "cells"


@pytest.fixture(params=["sapien.yaml", "mujoco.yaml"], scope="module")
def closed_cell(request: pytest.FixtureRequest) -> Cell:
    """A cell of every backend that can run without hardware, not connected."""
    return cell_from_yaml(CELLS / request.param)


@pytest.fixture(scope="module")
def open_world(closed_cell: Cell) -> Iterator[Cell]:
    with closed_cell.connected() as cell:
        yield cell


@pytest.fixture
def cell(open_world: Cell) -> Iterator[Cell]:
    """Connected, at home, without a fault."""
    open_world.arm.recover()
    open_world.arm.move_gripper(0.08)
    open_world.arm.move_to_joints(open_world.workspace.home)
    yield open_world
    open_world.arm.recover()
