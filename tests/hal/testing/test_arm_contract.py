"""The contract of arms fails for an arm that breaks it; the arms that pass are in tests/hal_contract."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest

from hal import Arm, Cell
from hal.testing import ArmContract
from tests.hal.replay.toy import ToyArm, toy_cell


class Deaf(ToyArm):
    """Goes wherever it was before, and says that it has arrived."""

    def _move_to_pose(self, T_base_tcp, speed):
        pass

    def _check_arrival(self, T_base_tcp):
        pass


class Unchecked(ToyArm):
    def move_gripper(self, width: float) -> None:
        self._width = width


def cell_with(arm: Arm) -> Cell:
    cell = toy_cell()
    home = np.array([0.45, 0.0, 0.5, 0, 0, 0, 0])
    return dataclasses.replace(cell, arm=arm, workspace=dataclasses.replace(cell.workspace, home=home))


@pytest.fixture
def sound() -> Iterator[Cell]:
    with ToyArm() as arm:
        yield cell_with(arm)


def test_a_sound_arm_passes(sound: Cell):
    contract = ArmContract()
    contract.test_state_has_units_and_shapes(sound)
    contract.test_a_straight_motion_arrives(sound, 0.0)
    contract.test_a_command_outside_the_limits_is_refused_and_nothing_moves(sound)


def test_an_arm_that_does_not_arrive_fails():
    with Deaf() as arm, pytest.raises(AssertionError):
        ArmContract().test_a_straight_motion_arrives(cell_with(arm), 0.0)


def test_an_arm_that_accepts_any_width_fails():
    with Unchecked() as arm, pytest.raises(pytest.fail.Exception, match="DID NOT RAISE"):
        ArmContract().test_a_command_outside_the_limits_is_refused_and_nothing_moves(cell_with(arm))


def test_an_arm_that_ignores_stop_fails(sound: Cell):
    with pytest.raises(pytest.fail.Exception, match="DID NOT RAISE"):
        ArmContract().test_stop_ends_every_kind_of_motion(sound, 0.0, lambda cell, k: None)
