from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from hal import Cell, cell_from_yaml

CELLS = Path(__file__).parents[2] / "configs" / "cells"

SLOW_ON_A_ROBOT = ("test_a_hand_that_meets_nothing_arrives", "test_a_straight_motion_arrives")
"""Contracts that take ten seconds and more of a robot that is simulated in real time."""


@pytest.hookimpl(tryfirst=True)  # before tests are chosen by their marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.parent != Path(__file__).parent:
            continue
        slow = item.name.startswith(SLOW_ON_A_ROBOT) and "[franky" in item.name
        if slow or (item.path.name == "test_arm_contract.py" and is_rehearsed(item)):
            item.add_marker(pytest.mark.slow)


def is_rehearsed(item: pytest.Item) -> bool:
    """Whether it tests SAPIEN's arm by a contract that the same arm has to pass while it is recorded."""
    return "[sapien" in item.name and "cell" in getattr(item, "fixturenames", ())


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
