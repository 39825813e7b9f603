"""Every program in examples/ runs as its docstring says, and stays short enough to read."""

import json
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from mskgrasp.benchmark.__main__ import main
from tests.programs import run_here, running

EXAMPLES = Path(__file__).parents[2] / "examples"


def run(name: str, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / name), *arguments],
        capture_output=True,
        text=True,
        timeout=300,
        env=os.environ | {"PYTHONPATH": str(EXAMPLES.parent)},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.name)
def test_an_example_has_at_most_60_lines(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 60


def test_a_grasp_planned_on_a_cad_file_lifts_the_part_in_simulation(monkeypatch, capsys):
    path = str(EXAMPLES / "plan_on_cad_file.py")
    monkeypatch.setattr(sys, "argv", [path])
    runpy.run_path(path, run_name="__main__")  # in this process, which has imported the simulator
    printed = capsys.readouterr().out
    assert "bracket: " in printed
    assert float(re.search(r"predicted quality ([\d.]+)", printed)[1]) > 0.9
    assert printed.rstrip().endswith("\nlifted")


@pytest.mark.slow
def test_a_client_has_the_server_plan_and_place():
    with running("mskgrasp.serve", "--port", "0", "--workers", "1") as server:
        address = re.match(r"http://127\.0\.0\.1:\d+", server.stdout.readline())[0]
        printed = run("serve_client.py", address)
    assert float(re.search(r"quality ([\d.]+)", printed)[1]) > 0.9
    assert "\n10 alternatives\n" in printed
    x, y = map(float, re.search(r"place with the hand at \[ *([\d.]+) +([\d.]+)", printed).groups())
    assert abs(x - 0.45) < 0.03 and abs(y - 0.1) < 0.03  # the grasp is near the block's centre


@pytest.mark.slow
def test_the_maniskill_task_runs_in_a_loop():
    printed = run("maniskill_task.py", "hex_nut_m30", "3")
    assert re.search(r"^[1-3] of 3 lifted, median shift [\d.]+ mm$", printed, re.MULTILINE)


def placed_by(planner: str, folder: Path, *options: str) -> dict:
    """The row of a planner in the report of a small benchmark."""
    few = ("--parts", "t_nut_m16x18", "--trials", "1", "--workers", "1")
    done = run_here(main, "--planners", planner, *few, "--out", str(folder / "out"), *options)
    assert done.returncode == 0, done.stderr
    (row,) = json.loads((folder / "out" / "report.json").read_text())["rows"]
    return row


@pytest.mark.slow
def test_a_planner_of_ones_own_takes_part_in_the_benchmark(tmp_path, monkeypatch):
    code = (EXAMPLES / "own_planner.py").read_text(encoding="utf-8")
    (name, value) = re.search(r'^    (\w+) = "(own_planner:\w+)"$', code, re.MULTILINE).groups()
    site = tmp_path / "site"
    info = site / "own_planner-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: own_planner\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[mskgrasp.planners]\n{name} = {value}\n")
    (site / "own_planner.py").write_text(code)
    monkeypatch.syspath_prepend(site)
    row = placed_by(name, tmp_path)
    assert row["planner"] == "highest" and row["lifted"]["of"] == 1


@pytest.mark.slow
def test_a_planner_program_takes_part_in_the_benchmark(tmp_path):
    program = f"{sys.executable} {EXAMPLES / 'planner_program.py'}"
    row = placed_by("program", tmp_path, "--program", program)
    assert row["planner"] == "program" and row["lifted"]["of"] == 1
