"""An arm played back."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import h5py
import numpy as np
import pytest

from hal import Load
from hal.errors import LoadTooHeavy, NotConnected, Stopped
from hal.replay import ReplayArm, ReplayArmConfig, read_recording, recorded_cell
from mskgrasp.core.grasp import MIN_GAP
from tests.hal.replay.program import replayed, run_on
from tests.hal.replay.toy import toy_cell


def test_an_arm_plays_back_alone(recording: Path):
    arm = ReplayArm(ReplayArmConfig(driver="replay", recording=recording))
    with arm:
        arm.open_gripper()
        assert arm.state().gripper_width == 0.08
    with pytest.raises(NotConnected):
        arm.state()


def test_stop_from_the_program_ends_what_follows(recording: Path):
    arm = ReplayArm(ReplayArmConfig(driver="replay", recording=recording))
    with arm:
        arm.stop()
        with pytest.raises(Stopped, match="stop"):
            arm.open_gripper()


LOAD = Load(mass=0.2, centre_tcp=np.array([0.0, 0.01, 0.02]), inertia=1e-4 * np.eye(3))


def test_a_part_in_the_hand_is_recorded_and_accepted_again(tmp_path: Path):
    path = tmp_path / "load.h5"
    with recorded_cell(toy_cell(), path).connected() as cell:
        cell.arm.set_load(LOAD)
        cell.arm.home()
        with pytest.raises(LoadTooHeavy):
            cell.arm.set_load(dataclasses.replace(LOAD, mass=9.0))
    first, second = read_recording(path).events
    assert (first.call, second.call) == ("set_load", "home")
    assert first.arguments["load"]["mass"] == 0.2 and first.arguments["load"]["centre_tcp"] == [0, 0.01, 0.02]
    with ReplayArm(ReplayArmConfig(driver="replay", recording=path)) as arm:
        arm.set_load(LOAD)
        arm.home()
        with pytest.raises(LoadTooHeavy):
            arm.set_load(dataclasses.replace(LOAD, mass=9.0))
        assert arm.hand() is None


def test_a_recording_from_before_the_hand_told_its_own_width_answers_a_program_of_today(
    recording: Path, tmp_path: Path
):
    """It opened the hand by its width, and neither states nor limits held what a hand reports."""
    path = tmp_path / "old.h5"
    path.write_bytes(recording.read_bytes())
    with h5py.File(path, "r+") as file:
        events = [json.loads(text) for text in file["events"].asstr()]  # pyright: ignore
        for event in events:
            if event["call"] == "open_gripper":
                event |= {"call": "move_gripper", "arguments": {"width": 0.08}}
            for state in (event["after"], event["result"]):
                if isinstance(state, dict):
                    state.pop("grasped", None)
                    state.pop("max_width", None)
        assert sum(event["call"] == "move_gripper" for event in events) >= 2
        file["events"][:] = [json.dumps(event) for event in events]  # pyright: ignore
        limits = json.loads(str(file.attrs["limits"]))
        del limits["closed_width"], limits["max_load"]
        file.attrs["limits"] = json.dumps(limits)
    played: list[list[object]] = [[], []]
    for number, one in enumerate((path, recording)):
        with replayed(one).connected() as cell:
            run_on(cell, played[number])
    assert json.dumps(played[0]) == json.dumps(played[1])
    assert replayed(path).arm.limits.closed_width == MIN_GAP
