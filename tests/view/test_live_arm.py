"""Arm and part of a cell in motion."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from hal import Cell
from hal.arm_state import ArmState
from hal.errors import CommunicationLost
from hal.mujoco import MujocoCellConfig, mujoco_cell
from hal.simulated import SimulatedArm
from mskgrasp.view.live_arm import LiveArm
from mskgrasp.view.page import Page
from tests.view.conftest import node, pose_of

MESH = trimesh.creation.box([0.02, 0.02, 0.02])


@pytest.fixture(scope="module")
def cell() -> Iterator[Cell]:
    with mujoco_cell(MujocoCellConfig(type="mujoco")).connected() as cell:
        yield cell


def test_arm_and_part_are_drawn_where_they_are(page: Page, cell: Cell):
    assert cell.tracker is not None
    live = LiveArm(page, "", cell, MESH)
    live.look()
    tcp = cell.arm.state().T_base_tcp
    np.testing.assert_allclose(pose_of(page, "/arm/7").position, tcp.position, atol=1e-6)
    np.testing.assert_allclose(pose_of(page, "/part").position, cell.tracker.part_pose().position)


def test_a_simulated_motion_is_drawn_on_its_way_and_takes_its_time(page: Page, cell: Cell, monkeypatch):
    live = LiveArm(page, "", cell, None)
    places: list[float] = []
    look = live.look
    monkeypatch.setattr(live, "look", lambda: (look(), places.append(pose_of(page, "/arm/7").position[1])))
    began = time.monotonic()
    with live.in_motion():
        cell.arm.move_to_joints(cell.workspace.home + np.array([0.4, 0, 0, 0, 0, 0, 0]), speed=0.4)
    took = time.monotonic() - began
    cell.arm.move_to_joints(cell.workspace.home)  # nobody looks
    assert len(places) >= 5 and np.diff(places).min() > -1e-4 and places[-1] > places[0] + 0.1
    assert took > 0.4 / (0.4 * 2.0)  # at the greatest speed of the joint all the way


class Unwatched(SimulatedArm):
    """Stands in for a real arm: its state may be read by any thread."""


def test_a_real_arm_is_looked_at_by_another_thread_until_the_motion_is_over_or_it_is_lost(
    page: Page, cell: Cell, monkeypatch
):
    state = cell.arm.state()
    readers: list[int] = []

    def read() -> ArmState:
        readers.append(threading.get_ident())
        if len(readers) > 3:
            raise CommunicationLost("the cable was pulled")
        return state

    monkeypatch.setattr(cell.arm, "state", read)
    monkeypatch.setattr("mskgrasp.view.live_arm.SimulatedArm", Unwatched)
    live = LiveArm(page, "", replace(cell, tracker=None), None)
    with live.in_motion():
        deadline = time.monotonic() + 20
        while len(readers) < 4 and time.monotonic() < deadline:
            time.sleep(0.01)
    assert len(readers) == 4 and threading.get_ident() not in readers


def test_a_recorded_cell_is_asked_nothing(page: Page, cell: Cell, monkeypatch):
    monkeypatch.setattr(cell.arm, "state", lambda: pytest.fail("asked for its state"))
    live = LiveArm(page, "", replace(cell, recorded=True), MESH)
    live.look()
    with live.in_motion():
        pass
    assert live.part_pose() is None and not node(page, "/arm").visible
