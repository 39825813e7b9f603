"""The program: what it prints, stores and refuses."""

from __future__ import annotations

import json

import pytest

from mskgrasp.validate.__main__ import main
from tests.programs import run_here


@pytest.mark.slow
def test_the_production_settings_pass_every_closed_form_check(tmp_path):
    done = run_here(main, "--no-convergence", "--parts", "hex_nut_m20", "--out", str(tmp_path / "out"))
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


def test_an_output_folder_that_cannot_be_made_is_reported_before_any_part_is_looked_for(tmp_path):
    (tmp_path / "file").write_text("in the way")
    done = run_here(main, "--parts", "no_such_part", "--out", str(tmp_path / "file" / "out"))
    assert done.returncode == 2 and "file is a file; choose another --out" in done.stderr
