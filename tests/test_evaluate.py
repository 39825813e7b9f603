"""The evaluation as a program, in the simulated cell with the small trained model."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.errors import BadDataset
from mskgrasp.outcomes import summarise
from mskgrasp.runs import read
from mskgrasp.trial import Trial

REPOSITORY = Path(__file__).parents[1]
MODEL = REPOSITORY / "tests" / "sim_in_the_loop" / "model"
CELL = REPOSITORY / "configs" / "cells" / "sapien.yaml"


def evaluate(out: Path, *options: str, models: Path = MODEL) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mskgrasp.evaluate", "--cell", str(CELL), "--models", str(models)]
    command += ["--out", str(out), "--planner.n-candidates", "100", *options]
    return subprocess.run(command, capture_output=True, text=True, cwd=REPOSITORY, timeout=250)


def trial(**changes: object) -> Trial:
    values = dict(
        part="a", number=0, seed=1, success=True, reason="", grasp=[0.5, 0.0, 0.02, 0.0], quality=0.9,
        predicted=[0.003, 0.0, 0.0, 0.1], predicted_std=[0.001] * 4, measured=[0.0, 0.004, 0.0, -0.1],
        tilt=0.0, planning_s=1.0,
    )  # fmt: skip
    return Trial(**(values | changes))  # type: ignore[arg-type]


def test_errors_are_those_of_the_definition():
    numbers = summarise([trial(), trial(number=1, success=False, reason="missed", measured=None)])["overall"]
    assert numbers["trials"] == 2 and numbers["successes"] == 1 and numbers["success_rate"] == 0.5
    assert numbers["translation_rmse"] == pytest.approx(0.005)
    assert numbers["rotation_rmse"] == pytest.approx(0.2)
    assert numbers["translation_rmse_of_zero"] == pytest.approx(0.004)


def test_without_a_success_errors_are_absent_not_zero():
    nothing = dict(
        grasp=None, quality=None, predicted=None, predicted_std=None, measured=None, planning_s=None
    )
    numbers = summarise([trial(success=False, reason="NoPartFound", **nothing)])["overall"]
    assert numbers["translation_rmse"] is None and numbers["median_planning_s"] is None
    assert numbers["reasons"] == {"NoPartFound": 1}


def test_trials_survive_the_file_and_a_line_cut_short(tmp_path):
    path = tmp_path / "trials.jsonl"
    first, second = trial(predicted_std=[np.nan] * 4), trial(number=1)
    lines = [json.dumps(one.to_json(), allow_nan=False) for one in (first, second)]
    path.write_text(lines[0] + "\n" + lines[1][:40])
    (found,) = read(path, Trial.from_json)
    assert (found.part, found.number) == ("a", 0)
    assert np.isnan(found.predicted_std).all() and found.measured == first.measured
    assert path.read_text() == lines[0] + "\n"
    path.write_text("no json\n")
    with pytest.raises(BadDataset, match="line 1 is no trial"):
        read(path, Trial.from_json)


def test_an_evaluation_goes_on_and_refuses_another_model(tmp_path):
    models, out = tmp_path / "model", tmp_path / "eval"
    shutil.copytree(MODEL, models)
    typo = evaluate(out, "--parts", "hex_nut_m30", models=tmp_path / "typo")
    assert typo.returncode == 1 and "typo" in typo.stderr and not out.exists()

    done = evaluate(out, "--parts", "hex_nut_m30", "--trials", "1", models=models)
    assert done.returncode == 0, done.stderr
    assert "1 of 1" in done.stdout or "0 of 1" in done.stdout
    first = (out / "trials.jsonl").read_text()

    more = evaluate(out, "--parts", "hex_nut_m30", "--trials", "2", models=models)
    assert more.returncode == 0, more.stderr
    lines = (out / "trials.jsonl").read_text()
    assert lines.startswith(first) and len(lines.splitlines()) == 2
    report = json.loads((out / "report.json").read_text())
    assert report["overall"]["trials"] == 2
    assert len(list((out / "plans").glob("*.png"))) == 2

    meta = json.loads((models / "model.json").read_text())
    meta["metrics"] = {}
    (models / "model.json").write_text(json.dumps(meta))
    other = evaluate(out, "--parts", "hex_nut_m30", "--trials", "3", models=models)
    assert other.returncode == 2 and "model.json differ" in other.stderr
