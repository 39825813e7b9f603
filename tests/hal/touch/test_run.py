"""The program on simulated cells and on both drivers of a real one."""

from __future__ import annotations

import io
import json
import os
import signal
from pathlib import Path

import numpy as np
import pytest
import yaml

from hal import Cell
from hal.franka.arm import FrankaArm
from hal.operator import Operator
from hal.replay import recorded_cell
from hal.touch import run as touch
from hal.touch import touches
from tests.hal.franka.robots import robot_for, write_cell
from tests.hal.real_cell import REAL, REPLAYED
from tests.hal.replay.toy import toy_cell
from tests.hal.touch.tables import CELLS, FeelingArm, feeling_cell, simulated_file, tilted
from tests.programs import run_here

QUICK = ("--speed", "0.025")


@pytest.mark.parametrize("kind", [pytest.param("sapien", marks=pytest.mark.slow), "mujoco"])
def test_a_simulated_table_tilted_by_half_a_degree_and_3_mm_off_is_measured(tmp_path: Path, kind: str):
    path = simulated_file(tmp_path, kind, height=0.003, slope=[0.0075, -0.0044])
    before = path.read_bytes()
    done = run_here(touch.main, "--cell", str(path), "--out", str(tmp_path / "out"), *QUICK)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "out" / "table.json").read_text())
    # On a slope a corner of the pads meets the table first, 0.13 mm above the point between the pads.
    assert found["table_z"] == pytest.approx(0.003, abs=2e-4)
    assert found["table_slope"] == pytest.approx([0.0075, -0.0044], abs=2e-4)
    assert found["tilt_deg"] == pytest.approx(0.5, abs=0.02) and np.abs(found["residuals"]).max() < 5e-5
    assert (tmp_path / "out" / "table.png").is_file()
    assert path.read_bytes() == before and "mm from the stated" in done.stdout


@pytest.mark.slow
def test_the_shipped_simulated_cell_has_the_table_that_it_states(tmp_path: Path):
    done = run_here(touch.main, "--cell", str(CELLS / "mujoco.yaml"), "--out", str(tmp_path), *QUICK)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "table.json").read_text())
    assert abs(found["table_z"]) < 1e-4 and not found["tilt_matters"]


DRIVERS = [pytest.param(name, marks=pytest.mark.slow) for name in ("franky", "panda_py")]


def real_file(folder: Path, driver: str, host: str, table_z: float | None) -> Path:
    path = write_cell(folder, driver, host)  # type: ignore[arg-type]
    text = path.read_text()
    assert "table_z: 0.0" in text
    path.write_text("# my cell\n" + text.replace("table_z: 0.0", f"table_z: {json.dumps(table_z)} # tape"))
    return path


@pytest.mark.parametrize("driver", DRIVERS)
def test_a_real_cells_file_gets_the_table_that_its_robot_feels(tmp_path: Path, driver: str):
    with robot_for(driver) as robot:  # type: ignore[arg-type]
        robot.order("table 0.012 0.006")
        path = real_file(tmp_path, driver, robot.host, None)
        done = run_here(
            touch.main, "--cell", str(path), "--out", str(tmp_path / "out"), "--table-at", "0.02", "--yes",
            *QUICK,
        )  # fmt: skip
    assert done.returncode == 0, done.stderr
    text = path.read_text()
    assert text.startswith("# my cell\n") and "# tape" in text
    workspace = yaml.safe_load(text)["workspace"]
    # 5 N press a table of 2e4 N/m by 0.25 mm; its height is that at x = 0.
    assert workspace["table_z"] == pytest.approx(0.012 + 0.5 * 0.006, abs=6e-4)
    assert workspace["table_slope"] == pytest.approx([0.006, 0.0], abs=1e-3)
    assert json.loads((tmp_path / "out" / "table.json").read_text())["stated_table_z"] is None


@pytest.mark.slow
def test_a_driver_that_dies_in_the_middle_of_a_touch_leaves_nothing_half_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    ask, asked = FrankaArm._ask, []

    def die_in_the_second(self: FrankaArm, op: str, **values: object) -> object:
        if op == "move_straight" and values.get("until_force") is not None:
            asked.append(op)
            if len(asked) == 2:
                os.kill(self._connected_link().pid, signal.SIGKILL)
        return ask(self, op, **values)  # type: ignore[arg-type]

    monkeypatch.setattr(FrankaArm, "_ask", die_in_the_second)
    with robot_for("franky") as robot:
        robot.order("table 0.0 0.0")
        path = real_file(tmp_path, "franky", robot.host, 0.0)
        before = path.read_bytes()
        done = run_here(touch.main, "--cell", str(path), "--out", str(tmp_path / "out"), "--yes", *QUICK)
        begin = robot.joints()
        robot.wait(0.5)
        assert robot.joints() == pytest.approx(begin, abs=5e-3)
    assert done.returncode == 1 and "ended by SIGKILL" in done.stderr and done.stderr.count("\n") == 1
    assert path.read_bytes() == before and not (tmp_path / "out").exists()


@pytest.mark.slow
def test_touches_that_fit_no_plane_write_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    touched = touches._touch

    def on_a_chip(arm, xy, *rest):
        point = touched(arm, xy, *rest)
        return point + [0, 0, 0.002] if xy[0] > 0.5 and xy[1] > 0 else point

    monkeypatch.setattr(touches, "_touch", on_a_chip)
    done = run_here(touch.main, "--cell", str(CELLS / "mujoco.yaml"), "--out", str(tmp_path / "out"), *QUICK)
    assert done.returncode == 1 and "fit no plane" in done.stderr and done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_table_that_is_not_found_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(touches, "_touch", lambda *_: None)
    done = run_here(touch.main, "--cell", str(CELLS / "mujoco.yaml"), "--out", str(tmp_path / "out"), *QUICK)
    assert done.returncode == 1 and "met no table" in done.stderr and done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "arguments", "message"),
    [
        (None, (), "No such file"),
        ("", (), "'type' is missing; legal: sapien"),
        ("type: replay\nrecording: a.h5\n", (), "a recording has no table to touch"),
        (f"type: recorded\ncell: {CELLS}/sapien.yaml\nout: b.h5\n", (), "a recording has no table to touch"),
        (REPLAYED, (), "a recording has no table to touch"),
        (REAL + "workspace: {table_z: null}\n", (), "give it as --table-at Z"),
        (REAL + "workspace: {}\n", ("--table-at", "0"), "no workspace.table_z"),
        (REAL, ("--table-at", "0"), "'workspace': field required"),
        (
            REAL + "v: &v {table_z: 0.0}\nworkspace: *v\n",
            (),
            "the table could not be written into workspace, whose text stands for other places",
        ),
        (REAL + "workspace: {table_z: null}\n", ("--table-at", "0"), "standard input is no terminal"),
        ("type: mujoco\n", ("--table-at", "0"), "--table-at is for a cell with arm and camera"),
        ("type: mujoco\n", ("--force", "90"), "less than or equal to 15"),
        ("type: mujoco\n", ("--out", "cell.yaml"), "is a file; choose another --out"),
    ],
)
def test_wrong_input_is_one_line_and_exit_code_2(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    text: str | None,
    arguments: tuple[str, ...],
    message: str,
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", io.StringIO())
    if text is not None:
        Path("cell.yaml").write_text(text)
    if "a.h5" in (text or ""):
        with recorded_cell(toy_cell(), Path("a.h5")).connected() as cell:
            cell.arm.state()
    before = sorted(tmp_path.iterdir())
    done = run_here(touch.main, "--cell", "cell.yaml", *arguments)
    assert done.returncode == 2 and message in done.stderr
    assert done.stderr.startswith("program: ") and done.stderr.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before


def felt(monkeypatch: pytest.MonkeyPatch, folder: Path, answers: list[bool]) -> Path:
    """A real cell's file whose arm feels a sloping table; its operator gives these answers."""
    stated: list[float] = []

    def build(values: dict, path: Path) -> Cell:
        stated.append(values["workspace"]["table_z"])
        return feeling_cell(tilted(0.013, (0.008, 0.0)), table_z=stated[0])

    monkeypatch.setattr(touch, "cell_from_values", build)
    monkeypatch.setattr(Operator, "__init__", lambda self, cell, yes: None)
    monkeypatch.setattr(Operator, "confirm", lambda self, question: answers.pop(0))
    path = folder / "cell.yaml"
    path.write_text(REAL + "workspace:\n  table_z: null   # tape\n  region: [0.38, 0.62, -0.12, 0.12]\n")
    return path


def test_an_operator_who_agrees_twice_gets_the_file_written(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    path = felt(monkeypatch, tmp_path, [True, True])
    before, out = path.read_text(), str(tmp_path / "out")
    done = run_here(touch.main, "--cell", str(path), "--table-at", "0.0", "--out", out)
    assert done.returncode == 0, done.stderr
    assert path.read_text() == before.replace(
        "table_z: null   # tape\n", "table_z: 0.013   # tape\n  table_slope: [0.008, 0.0]\n"
    )
    assert sorted(found.name for found in (tmp_path / "out").iterdir()) == ["table.json", "table.png"]


def test_the_file_of_a_simulated_arm_keeps_its_workspace(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    answers = [True, True]
    path = felt(monkeypatch, tmp_path, answers)
    monkeypatch.setattr(FeelingArm, "simulated", True)
    before, out = path.read_text(), str(tmp_path / "out")
    done = run_here(touch.main, "--cell", str(path), "--table-at", "0.0", "--out", out)
    assert done.returncode == 0 and (tmp_path / "out" / "table.json").is_file(), done.stderr
    assert path.read_text() == before and answers == [True]  # only whether the arm may move


def test_an_operator_who_does_not_want_the_file_written_keeps_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    path = felt(monkeypatch, tmp_path, [True, False])
    before, out = path.read_text(), str(tmp_path / "out")
    done = run_here(touch.main, "--cell", str(path), "--table-at", "0.0", "--out", out)
    assert done.returncode == 0 and "is as before" in done.stdout
    assert path.read_text() == before and (tmp_path / "out" / "table.json").is_file()


def test_an_operator_who_does_not_want_the_arm_to_move_ends_the_run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    path = felt(monkeypatch, tmp_path, [False])
    before, out = path.read_text(), str(tmp_path / "out")
    done = run_here(touch.main, "--cell", str(path), "--table-at", "0.0", "--out", out)
    assert done.returncode == 130 and "nothing moved" in done.stderr
    assert path.read_text() == before and not (tmp_path / "out").exists()


def test_the_help_teaches_what_happens_to_the_cell_and_its_file():
    done = run_here(touch.main, "--help")
    for words in ("emergency", "--table-at", "table.json", "table_slope", "stays as it is", "docs/touch.md"):
        assert words in done.stdout
