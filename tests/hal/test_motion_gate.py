"""The gate of motions, by the threads that a cell has."""

from __future__ import annotations

import threading

import pytest

from hal.errors import MotionAborted, NeedsRecovery, OutOfWorkspace, Stopped
from hal.motion_gate import MotionGate

TIMEOUT_S = 30.0


def pressed() -> None:
    """A recovery that the robot refuses."""
    raise NeedsRecovery("the user stop is pressed")


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
    with pytest.raises(NeedsRecovery, match="pressed"):
        gate.recover(pressed)
    with pytest.raises(NeedsRecovery, match="user stop"), gate.motion(lambda: None):
        pytest.fail("the gate let a motion through")


def test_a_stop_during_the_recovery_stays_in_force(gate: MotionGate):
    gate.recover(gate.stop.set)
    assert gate.fault is None
    with pytest.raises(NeedsRecovery, match=r"^stop\(\) was called"), gate.motion(lambda: None):
        pytest.fail("the gate let a motion through")


def test_a_motion_that_watched_the_stop_and_ended_quietly_was_stopped(gate: MotionGate, halts: list[bool]):
    with pytest.raises(Stopped), gate.motion(lambda: halts.append(True)):
        gate.stop.set()
    assert halts == [True] and gate.fault is not None


def test_ctrl_c_halts_the_arm_and_needs_a_recovery(gate: MotionGate, halts: list[bool]):
    with pytest.raises(KeyboardInterrupt), gate.motion(lambda: halts.append(True)):
        raise KeyboardInterrupt
    assert halts == [True] and gate.fault == "KeyboardInterrupt"


def test_the_first_cause_is_kept_where_the_recovery_fails(gate: MotionGate):
    with pytest.raises(MotionAborted), gate.motion(lambda: None):
        raise MotionAborted("contact")
    with pytest.raises(NeedsRecovery, match="pressed"):
        gate.recover(pressed)
    assert gate.fault == "contact"


@pytest.mark.parametrize("command", ["motion", "recovery"])
def test_what_another_thread_commands_begins_when_the_motion_is_over(gate: MotionGate, command: str):
    order: list[str] = []

    def second() -> None:
        if command == "recovery":
            gate.recover(lambda: order.append("second"))
        else:
            with gate.motion(lambda: None):
                order.append("second")

    thread = threading.Thread(target=second)
    with gate.motion(lambda: None):
        thread.start()
        thread.join(0.1)
        order.append("first")
    thread.join(TIMEOUT_S)
    assert order == ["first", "second"]
