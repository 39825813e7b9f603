"""Homing on simulated cells and on a real one over the wire."""

from __future__ import annotations

import functools
import io
from pathlib import Path

import pytest

from hal.home import run as home
from hal.operator import Operator
from tests.hal.franka.robots import fci5, robot_for, write_cell
from tests.programs import run_here

CELLS = Path(__file__).parents[3] / "configs" / "cells"


@pytest.mark.parametrize("kind", ["sapien", "mujoco"])
def test_a_simulated_hand_opens(kind: str):
    done = run_here(home.main, "--cell", str(CELLS / f"{kind}.yaml"))
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("homed: the fingers open to 80.0 mm, 80.0 mm before; they stand at ")


def test_changed_fingers_are_found_and_the_arm_stands_still(tmp_path: Path):
    with fci5() as robot:
        robot.order("fingers 0.0655")
        before = robot.joints()
        done = run_here(home.main, "--cell", str(write_cell(tmp_path, "panda_py", robot.host)), "--yes")
        assert robot.joints() == pytest.approx(before, abs=1e-3)
    assert done.returncode == 0, done.stderr
    assert "open to 65.5 mm, 80.0 mm before; they stand at 65.5 mm" in done.stdout


@pytest.mark.parametrize(("answers", "code"), [("y\n\n", 0), ("y\nq\n", 130)])
def test_a_robot_left_in_a_reflex_is_recovered_once_its_operator_has_checked_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, answers: str, code: int
):
    prompts = io.StringIO()
    asked = functools.partial(Operator, answers=io.StringIO(answers), prompts=prompts)
    monkeypatch.setattr(home, "Operator", asked)
    with fci5() as robot:
        robot.order("reflex")
        before = robot.joints()
        done = run_here(home.main, "--cell", str(write_cell(tmp_path, "panda_py", robot.host)))
        assert robot.joints() == pytest.approx(before, abs=1e-3)
    assert done.returncode == code, done.stderr
    assert (
        "is in mode reflex" in prompts.getvalue() and "the fingers close and open), q" in prompts.getvalue()
    )
    assert done.stdout.startswith("homed: ") == (code == 0)


def test_an_operator_who_does_not_want_the_fingers_to_move_ends_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(Operator, "__init__", lambda self, cell, yes: None)
    monkeypatch.setattr(Operator, "confirm", lambda self, question: False)
    with robot_for("franky") as robot:
        done = run_here(home.main, "--cell", str(write_cell(tmp_path, "franky", robot.host)))
    assert done.returncode == 130 and "nothing moved" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ((), 2, "missing: --cell"),
        (("--cell", "none.yaml"), 2, "No such file"),
        (("--cell", "panda_py.yaml"), 2, "standard input is no terminal"),
        (("--cell", "panda_py.yaml", "--yes"), 1, "no robot at 127.0.0.1"),
        (("--cell", "panda_py.yaml", "--force", "3"), 2, "unknown option --force"),
    ],
)
def test_wrong_input_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], code: int, message: str
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", io.StringIO())
    write_cell(tmp_path, "panda_py", "127.0.0.1")
    done = run_here(home.main, *arguments)
    assert done.returncode == code and message in done.stderr
    assert done.stderr.startswith("program: ") and done.stderr.count("\n") == 1


def test_the_help_teaches_when_it_is_needed():
    done = run_here(home.main, "--help")
    for words in ("fingers were changed", "falls", "--yes"):
        assert words in " ".join(done.stdout.split())
