"""Simulated cells of the tests of part poses."""

from collections.abc import Iterator

import pytest

from hal.cell import Cell
from hal.open_cell import open_cell


@pytest.fixture(scope="session")
def mujoco_cell() -> Iterator[Cell]:
    with open_cell("configs/cells/mujoco.yaml") as cell:
        yield cell


@pytest.fixture(scope="session")
def sapien_cell() -> Iterator[Cell]:
    with open_cell("configs/cells/sapien.yaml") as cell:
        yield cell
