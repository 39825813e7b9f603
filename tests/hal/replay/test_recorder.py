"""Recording devices pass on what they are asked."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hal.errors import CommunicationLost, MotionAborted, OutOfWorkspace
from hal.replay import RecordingWriter, read_recording, recorded_cell
from tests.hal.replay.program import at, run_on
from tests.hal.replay.toy import ToyArm, ToyCamera, toy_cell


def test_a_recorded_cell_does_what_the_cell_does(tmp_path: Path):
    bare, kept = toy_cell(), toy_cell()
    logs: list[list[object]] = [[], []]
    with bare.connected():
        run_on(bare, logs[0])
    with recorded_cell(kept, tmp_path / "run.h5").connected() as cell:
        run_on(cell, logs[1])
    assert json.dumps(logs[0]) == json.dumps(logs[1])
    assert isinstance(bare.arm, ToyArm) and isinstance(kept.arm, ToyArm)
    assert bare.arm.moves == kept.arm.moves


def test_a_command_is_kept_with_its_arguments_its_error_and_the_state_after_it(tmp_path: Path):
    with recorded_cell(toy_cell(), tmp_path / "run.h5").connected() as cell:
        cell.arm.move_gripper(0.05)
        with pytest.raises(OutOfWorkspace):
            cell.arm.move_gripper(0.2)
        with pytest.raises(MotionAborted):
            cell.arm.move_to_pose(at(0.03), speed=0.25)
        cell.arm.stop()
    gripper, refused, aborted, stopped = read_recording(tmp_path / "run.h5").events
    assert (gripper.call, gripper.arguments, gripper.error) == ("move_gripper", {"width": 0.05}, None)
    assert gripper.after is not None and gripper.after["width"] == 0.05
    assert refused.error is not None and refused.error[0] == "OutOfWorkspace"
    assert aborted.arguments["speed"] == 0.25 and aborted.arguments["T_base_tcp"][:3] == [0.4, 0.0, 0.03]
    assert aborted.error is not None and aborted.error[0] == "MotionAborted"
    assert (stopped.call, stopped.arguments) == ("stop", {})
    times = [event.at_s for event in (gripper, refused, aborted, stopped)]
    assert times == sorted(times) and min(event.took_s for event in (gripper, aborted)) >= 0


def test_a_recorded_camera_says_of_itself_what_the_camera_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    cell = recorded_cell(toy_cell(), tmp_path / "run.h5")
    assert (cell.camera.by_hand, cell.camera.exposures) == (False, 1)
    monkeypatch.setattr(ToyCamera, "by_hand", True)
    monkeypatch.setattr(ToyCamera, "exposures", 9)
    assert (cell.camera.by_hand, cell.camera.exposures) == (True, 9)


def test_an_arm_stops_before_its_stop_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    order: list[str] = []
    with recorded_cell(toy_cell(), tmp_path / "run.h5").connected() as cell:
        monkeypatch.setattr(ToyArm, "_halt", lambda self: order.append("halted"))
        write = RecordingWriter._append
        monkeypatch.setattr(
            RecordingWriter, "_append", lambda self, event: (order.append(event.call), write(self, event))
        )
        cell.arm.stop()
    assert order == ["halted", "stop"]


def test_a_device_that_fails_to_close_still_closes_the_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    cell = recorded_cell(toy_cell(), tmp_path / "run.h5")

    def fail(_: ToyArm) -> None:
        raise CommunicationLost("the link is lost")

    monkeypatch.setattr(ToyArm, "close", fail)
    with pytest.raises(CommunicationLost), cell.connected() as connected:
        connected.arm.move_gripper(0.05)
    assert [event.call for event in read_recording(tmp_path / "run.h5").events] == ["move_gripper"]


def test_a_recorded_arm_is_slowed_by_its_own_speeds(tmp_path: Path):
    bare = toy_cell()
    recorded_cell(bare, tmp_path / "run.h5").arm.slow_down(0.1)
    assert bare.arm.pace == 0.1
