"""Errors of cells: what catches what, and how they end a program."""

from __future__ import annotations

import pytest

from hal import errors
from hal.errors import HalError, MissingRecording, MotionAborted, NeedsRecovery, OutOfWorkspace, Stopped
from mskgrasp.core.errors import MskgraspError, UsageError
from tests.programs import run_here

KINDS = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, HalError)]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_a_program_ends_with_one_line_and_code_1_or_2_if_a_file_does_not_exist(kind: type[HalError]):
    """A fault of the cell; only a recording that does not exist is one of the command line."""

    def main() -> None:
        raise kind("the lamp is out; plug it in")

    done = run_here(main)
    assert (done.returncode, done.stdout) == (2 if kind is MissingRecording else 1, "")
    assert done.stderr == "program: the lamp is out; plug it in\n"
    assert issubclass(kind, MskgraspError) and issubclass(kind, UsageError) == (kind is MissingRecording)


def test_a_stop_ends_motions_but_is_no_mere_abort():
    """A program may answer contact by going on; `except Stopped` first keeps it from answering a stop so."""
    with pytest.raises(MotionAborted):
        raise Stopped("stop() was called")
    assert [kind for kind in KINDS if issubclass(kind, MotionAborted)] == [MotionAborted, Stopped]


def test_a_refusal_and_a_fault_are_distinguished():
    """After `OutOfWorkspace` the arm may move, after the others it must be recovered."""
    faults = (MotionAborted, NeedsRecovery)
    assert not issubclass(OutOfWorkspace, faults)
    assert not any(issubclass(kind, OutOfWorkspace) for kind in KINDS if kind is not OutOfWorkspace)
