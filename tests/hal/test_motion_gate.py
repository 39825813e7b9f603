"""The gate of motions, by the threads that a cell has."""

from __future__ import annotations

import threading

import pytest

from hal.errors import MotionAborted, NeedsRecovery, OutOfWorkspace, Stopped
from hal.motion_gate import MotionGate

TIMEOUT_S = 30.0


@pytest.fixture
def gate() -> MotionGate:
    return MotionGate()


@pytest.fixture
def halts() -> list[bool]:
    return []


def test_an_error_halts_and_forbids_motions_until_it_is_acknowledged(gate: MotionGate, halts: list[bool]):
    with pytest.raises(MotionAborted, match="contact"), gate.motion(lambda: halts.append(True)):
        raise MotionAborted("contact")
    with pytest.raises(NeedsRecovery, match=r"stopped before \(contact\)"), gate.motion(lambda: None):
        pytest.fail("the gate let a motion through")
    gate.recover(lambda: None)
    with gate.motion(lambda: halts.append(True)):
        pass
    assert halts == [True]


def test_a_refusal_is_no_fault_and_halts_nothing(gate: MotionGate, halts: list[bool]):
    with pytest.raises(OutOfWorkspace), gate.motion(lambda: halts.append(True)):
        raise OutOfWorkspace("too far")
    assert gate.fault is None and halts == []


def test_a_stop_names_itself_whatever_the_backend_reports_then(gate: MotionGate, halts: list[bool]):
    with pytest.raises(Stopped), gate.motion(lambda: halts.append(True)):
        gate.stop.set()
        raise MotionAborted("the robot reports a reflex")
    assert halts == [True]
    gate.recover(lambda: None)
    assert not gate.stop.is_set()


def test_a_cause_that_is_still_there_keeps_the_gate_closed(gate: MotionGate):
    def pressed() -> None:
        raise NeedsRecovery("the user stop is pressed")

    with pytest.raises(NeedsRecovery, match="pressed"):
        gate.recover(pressed)
    with pytest.raises(NeedsRecovery, match="user stop"), gate.motion(lambda: None):
        pytest.fail("the gate let a motion through")


def test_a_stop_during_the_recovery_stays_in_force(gate: MotionGate):
    gate.recover(gate.stop.set)
    with pytest.raises(NeedsRecovery, match="stop"), gate.motion(lambda: None):
        pytest.fail("the gate let a motion through")


def test_a_motion_of_another_thread_begins_when_the_first_is_over(gate: MotionGate):
    inside, ended = threading.Event(), []

    def second() -> None:
        inside.wait(TIMEOUT_S)
        with gate.motion(lambda: None):
            ended.append("second")

    thread = threading.Thread(target=second)
    thread.start()
    with gate.motion(lambda: None):
        inside.set()
        thread.join(0.1)
        ended.append("first")
    thread.join(TIMEOUT_S)
    assert ended == ["first", "second"]
