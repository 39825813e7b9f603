"""An arm played back."""

from __future__ import annotations

from pathlib import Path

import pytest

from hal.errors import NotConnected, Stopped
from hal.replay import ReplayArm, ReplayArmConfig


def test_an_arm_plays_back_alone(recording: Path):
    arm = ReplayArm(ReplayArmConfig(driver="replay", recording=recording))
    with arm:
        arm.move_gripper(0.08)
        assert arm.state().gripper_width == 0.08
    with pytest.raises(NotConnected):
        arm.state()


def test_stop_from_the_program_ends_what_follows(recording: Path):
    arm = ReplayArm(ReplayArmConfig(driver="replay", recording=recording))
    with arm:
        arm.stop()
        with pytest.raises(Stopped, match="stop"):
            arm.move_gripper(0.08)
