"""The program: what it prints, stores and refuses, and that a coarse simulation fails."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.settings import Physics
from mskgrasp.parts import find_part
from mskgrasp.validate.__main__ import main
from mskgrasp.validate.check import Check
from mskgrasp.validate.closed_form import run_checks
from mskgrasp.validate.config import Setting
from mskgrasp.validate.outcomes import draw_grasps, run_settings
from tests.programs import run_here

REPOSITORY = Path(__file__).parents[2]


def test_a_coarse_simulation_fails():
    reported: list[Check] = []
    coarse = Physics(rate_hz=100, position_iterations=4)
    checks = run_checks(coarse, reported.append)
    failed = [check.name for check in checks if not check.passed]
    assert "fall in 0.2 s" in failed and len(failed) >= 3
    assert reported == checks


def test_grasps_are_tried_once_and_read_afterwards(tmp_path):
    folders = [find_part("hex_nut_m20").folder]
    settings = [
        Setting(name="plain", physics=Physics(), n=3),
        Setting(name="moved", physics=Physics(), n=2, shift=1e-5),
        Setting(name="again", physics=Physics(), n=3),
    ]
    drawn = draw_grasps(folders, 3, 0, tmp_path, 1, lambda _: None)
    counts: list[int] = []
    first = run_settings(settings[:2], drawn, {}, tmp_path, 2, counts.append)
    assert sorted(counts) == [2, 3] and len(first["plain"].success) == 3
    assert first["moved"].index.tolist() == [0, 1] and set(first["moved"].part) == {"hex_nut_m20"}
    assert first["plain"].settled.all()
    times = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.npz")}
    second = run_settings(settings, drawn, {}, tmp_path, 1, counts.append)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.npz")} == times
    np.testing.assert_array_equal(first["plain"].displacement, second["again"].displacement)
    assert draw_grasps(folders, 3, 0, tmp_path, 1, lambda _: None) == drawn


def test_parts_that_a_setting_does_not_change_are_left_out(tmp_path):
    folders = [find_part("hex_nut_m20").folder]
    drawn = draw_grasps(folders, 1, 0, tmp_path, 1, lambda _: None)
    setting = Setting(name="other hulls", physics=Physics(), n=1, hulls="exact")
    found = run_settings([setting], drawn, {"other hulls": {}}, tmp_path, 1, lambda _: None)
    assert len(found["other hulls"].success) == 0 and found["other hulls"].displacement.shape == (0, 4)


def test_the_production_settings_pass_every_closed_form_check(tmp_path):
    done = validate("--no-convergence", "--parts", "hex_nut_m20", "--out", str(tmp_path / "out"))
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == "all checks passed"
    record = json.loads((tmp_path / "out" / "validate.json").read_text())
    assert record["failed"] == [] and len(record["closed_form"]) >= 13
    assert all(check["passed"] for check in record["closed_form"])
    assert record["parts"][0]["part"] == "hex_nut_m20" and record["parts"][0]["mass_error"] < 1e-4
    assert (tmp_path / "out" / "validate.png").stat().st_size > 20_000


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--parts", "no_such_part"], 2, "no_such_part"),
        (["--rates-hz", "50"], 2, "greater than or equal to 100"),
        (["--config", "no_such.yaml"], 2, "no_such.yaml"),
    ],
)
def test_mistakes_are_one_line(tmp_path, arguments, code, message):
    done = run_here(main, *arguments, "--out", str(tmp_path / "out"))
    assert done.returncode == code
    assert message in done.stderr.strip().splitlines()[-1]
    assert not (tmp_path / "out").exists()


def validate(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mskgrasp.validate", *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=REPOSITORY, timeout=300)
