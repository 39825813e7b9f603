"""The operator at a terminal: nothing moves unless they say so, and they may go at any time."""

from __future__ import annotations

import io
import os
import pty
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import yaml

from hal import cell_from_yaml
from hal.operator import Operator, StoppedByOperator
from mskgrasp.core.errors import UsageError

REAL = {
    "type": "devices",
    "arm": {"driver": "panda_py", "host": "127.0.0.250"},
    "camera": {"driver": "sapien"},
    "workspace": {"table_z": 0.0},
}
SIMULATED = Path(__file__).parents[2] / "configs" / "cells" / "sapien.yaml"


@pytest.fixture
def real(tmp_path: Path) -> Path:
    path = tmp_path / "cell.yaml"
    path.write_text(yaml.safe_dump(REAL))
    return path


def operator(real: Path, answers: str) -> tuple[Operator, io.StringIO]:
    prompts = io.StringIO()
    return Operator(cell_from_yaml(real), answers=io.StringIO(answers), prompts=prompts), prompts


def test_the_arm_moves_only_after_a_yes(real):
    asked, prompts = operator(real, "\nperhaps\nn\nYES\n")
    assert not asked.may_move(Path("out/next.png"), "grasp at x 0.5")
    assert asked.may_move(Path("out/next.png"), "grasp at x 0.5")
    text = prompts.getvalue()
    assert text.count("May the arm move?") == 4
    assert "'perhaps' is no valid answer" in text and "picture: out/next.png" in text


@pytest.mark.parametrize(
    ("answers", "why"), [("q\n", "stopped by the operator"), ("", "standard input ended")]
)
def test_an_operator_who_leaves_stops_the_run(real, answers, why):
    asked, _ = operator(real, answers)
    with pytest.raises(StoppedByOperator, match=why):
        asked.may_move(Path("a.png"), "")


def test_the_arm_is_recovered_only_when_its_way_is_clear(real):
    cell = cell_from_yaml(real)
    recovered: list[bool] = []
    cell.arm.recover = lambda: recovered.append(True)  # type: ignore[method-assign]
    asked, prompts = operator(real, "q\n")
    with pytest.raises(StoppedByOperator):
        asked.recover(cell, "contact force over 20 N")
    assert not recovered and "contact force over 20 N" in prompts.getvalue()
    asked, _ = operator(real, "\n")
    asked.recover(cell, "contact")
    assert recovered == [True]


def test_a_real_arm_needs_a_terminal_or_a_yes(real, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n" * 10))
    with pytest.raises(UsageError, match="standard input is no terminal.*--yes"):
        Operator(cell_from_yaml(real))
    monkeypatch.setattr("sys.stdin", None)  # closed
    with pytest.raises(UsageError, match="standard input is no terminal.*--yes"):
        Operator(cell_from_yaml(real))
    assert not Operator(cell_from_yaml(real), yes=True).asks
    assert not Operator(cell_from_yaml(SIMULATED)).asks


@pytest.mark.slow
def test_it_is_asked_in_a_terminal(real):
    code = (
        "import sys; from pathlib import Path; from hal import cell_from_yaml\n"
        "from hal.operator import Operator\n"
        "print(Operator(cell_from_yaml(Path(sys.argv[1]))).may_move(Path('a.png'), 'a grasp'))"
    )
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(real)], stdin=theirs, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    os.close(theirs)
    assert process.stderr is not None
    asked = b""
    while b"May the arm move? y: yes" not in asked:
        asked += os.read(process.stderr.fileno(), 1000)
    os.write(ours, b"y\n")
    out, err = process.communicate(timeout=60)
    os.close(ours)
    assert out == b"True\n", err


def test_what_was_typed_before_a_question_does_not_answer_it(real):
    """A second Enter, pressed while the arm moved: it must not recover an arm that has collided since."""
    cell = cell_from_yaml(real)
    recovered: list[bool] = []
    cell.arm.recover = lambda: recovered.append(True)  # type: ignore[method-assign]
    ours, theirs = pty.openpty()
    prompts = io.StringIO()

    def leave() -> None:
        while "Check it" not in prompts.getvalue():
            time.sleep(0.01)
        os.write(ours, b"q\n")

    with open(theirs) as answers:
        asked = Operator(cell, answers=answers, prompts=prompts)
        os.write(ours, b"\n")
        leaving = threading.Thread(target=leave)
        leaving.start()
        with pytest.raises(StoppedByOperator):
            asked.recover(cell, "contact force over 20 N")
        leaving.join()
    os.close(ours)
    assert not recovered


def test_a_question_is_answered_by_yes_or_no_and_not_asked_on_a_simulated_cell(real):
    asked, prompts = operator(real, "maybe\nNo\nyes\n")
    assert not asked.confirm("Write it? ") and asked.confirm("Write it? ")
    assert prompts.getvalue().count("Write it?") == 3
    assert Operator(cell_from_yaml(SIMULATED)).confirm("Write it? ")


def test_an_operator_takes_what_the_hand_holds_before_the_fingers_open(real):
    one, asked = operator(real, "\n")
    assert one.take() and "Take hold of it" in asked.getvalue()
    with pytest.raises(StoppedByOperator):
        operator(real, "q\n")[0].take()
    assert not Operator(cell_from_yaml(real), yes=True).take()


def test_a_number_is_asked_for_until_it_is_one_within_its_bounds(real):
    asked, prompts = operator(real, "thirty\n\n0.5\nnan\n31,5\n")
    assert asked.number("Reading, N: ", 1, 200) == 31.5
    assert prompts.getvalue().count("Reading, N: ") == 5
    assert "'thirty' is no number from 1 to 200." in prompts.getvalue()


@pytest.mark.parametrize("answers", ["q\n", ""])
def test_an_operator_may_stop_instead_of_giving_a_number(real, answers):
    asked, _ = operator(real, answers)
    with pytest.raises(StoppedByOperator):
        asked.number("Reading, N: ", 1, 200)
