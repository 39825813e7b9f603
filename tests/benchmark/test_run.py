"""The benchmark on both simulated cells, from the command line to the report."""

from __future__ import annotations

import json
import shlex
import sys
from pathlib import Path

import pytest

from mskgrasp.benchmark.__main__ import main
from mskgrasp.benchmark.part_list import BenchmarkPart
from mskgrasp.benchmark.run import known_families, known_parts, program_digests
from mskgrasp.runtime.run_folder import TRIALS, read_trials
from mskgrasp.trials.placed_trial import PlacedTrial
from tests.programs import Ended, run_here

PROGRAM = f"{shlex.quote(sys.executable)} {Path(__file__).parents[2] / 'examples' / 'planner_program.py'}"


def run(out: Path, *arguments: object) -> Ended:
    words = ("--parts", "t_nut_m16x18", "--trials", 1, "--workers", 1, "--out", out, *arguments)
    return run_here(main, *map(str, words))


def test_parts_that_the_networks_know_are_counted_for_each_planner_made_of_them():
    parts = [BenchmarkPart(name=name, family=name, split="test", standard="") for name in "abc"]
    training = {
        "": dict(training_parts=["a"], validation_parts=["b", "c", "d"]),
        "paper": dict(training_parts=["d"]),
    }
    rows = ("centroid", "paper", "ours", "certified")
    assert known_parts(rows, training, parts, "training_parts") == {"ours": 1, "certified": 1}
    assert known_parts(rows, training, parts, "validation_parts") == {"ours": 2, "certified": 2}


def test_other_parts_of_a_familiar_family_are_counted():
    nuts = [
        BenchmarkPart(name=name, family=family, split="test", standard="")
        for name, family in (("hex_nut_m20", "hex_nut"), ("mine", "bracket"))
    ]
    training = {"": dict(training_parts=["hex_nut_m30", "a_part_of_mine"])}
    assert known_families(("ours", "antipodal"), training, nuts) == {"ours": 1}
    assert known_families(("antipodal",), training, nuts) == {}


def test_a_program_that_is_edited_is_another_one(tmp_path):
    program = tmp_path / "planner.py"
    program.write_text("print(1)\n")
    command = f"{shlex.quote(sys.executable)} {program} --fast"
    first = program_digests(command)
    assert first["program"] == command and set(first) == {
        "program", f"program: {sys.executable}", f"program: {program}",
    }  # fmt: skip
    program.write_text("print(2)\n")
    assert {name for name, digest in program_digests(command).items() if first[name] != digest} == {
        f"program: {program}"
    }


def test_a_program_may_be_a_long_line(tmp_path):
    command = f"python3 -c '{'x = 1; ' * 100}'"
    assert program_digests(command)["program"] == command


def test_a_set_without_a_part_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("mskgrasp.benchmark.run.part_names", lambda *_: [])
    done = run(tmp_path / "out", "--parts", "test")
    assert done.returncode == 2 and "--parts test names no part" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_planners_are_compared_in_the_same_scene_and_stored_trials_are_kept(tmp_path):
    out = tmp_path / "out"
    planners = ("--planners", "centroid", "ours", "program", "--program", PROGRAM)
    done = run(out, *planners)
    assert done.returncode == 0, done.stderr
    values = json.loads((out / "report.json").read_text())
    assert values["headline"] in done.stdout
    assert [row["planner"] for row in values["rows"]] == ["centroid", "ours", "program"]
    centroid, ours, program = read_trials(out / TRIALS, PlacedTrial.from_json)
    assert centroid.lifted and centroid.quality is None and centroid.expected == [0.0] * 4
    assert program.quality == 0.5
    assert ours.placed is not None and ours.carried is not None and ours.seeing is not None
    # What the table sees of a box-like part is its centre.
    assert max(map(abs, ours.seeing)) < 0.002
    stored = (out / TRIALS).read_bytes()
    done = run(out, *planners[:-2], "antipodal", *planners[-2:])  # one more row
    assert done.returncode == 0, done.stderr
    assert (out / TRIALS).read_bytes().startswith(stored)
    assert [one.planner for one in read_trials(out / TRIALS, PlacedTrial.from_json)][3:] == ["antipodal"]
    other = run(out, "--seed", 1)
    assert other.returncode == 2 and "seed differ" in other.stderr


def test_mujoco_runs_the_same_scene(tmp_path):
    done = run(tmp_path / "out", "--cell", "mujoco", "--planners", "centroid")
    assert done.returncode == 0, done.stderr
    (trial,) = read_trials(tmp_path / "out" / TRIALS, PlacedTrial.from_json)
    assert trial.condition == "mujoco" and trial.lifted and trial.placed is not None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--cell", "nowhere.yaml"), "nowhere.yaml"),
        (("--planners", "paper"), "planner 'paper' needs --paper-models"),
        (("--models", "nowhere"), "nowhere"),
        (("--parts", "no_such_part"), "no part or part folder is called"),
    ],
)
def test_what_cannot_run_is_refused_in_a_line(arguments, message, tmp_path):
    done = run(tmp_path / "out", *arguments)
    assert done.returncode == 2 and message in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
