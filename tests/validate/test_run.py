"""The program: what it prints, stores and refuses."""

from __future__ import annotations

import json
import shutil

import pytest

from mskgrasp.parts import find_part
from mskgrasp.validate.__main__ import main
from mskgrasp.validate.config import ValidateConfig
from mskgrasp.validate.run import _altered
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


def test_two_parts_of_one_name_are_refused_before_anything_is_simulated(tmp_path):
    copy = shutil.copytree(find_part("hex_nut_m20").folder, tmp_path / "copy")
    done = run_here(main, "--parts", "hex_nut_m20", str(copy), "--out", str(tmp_path / "out"))
    assert done.returncode == 2
    assert done.stderr.endswith("--parts: two parts are called 'hex_nut_m20'; leave one out\n")
    assert not (tmp_path / "out").exists()


def test_parts_in_folders_of_one_name_are_told_apart(tmp_path):
    names = ("hex_nut_m20", "hex_nut_m30")
    parts = [find_part(shutil.copytree(find_part(n).folder, tmp_path / n / "nut")) for n in names]
    settings = ValidateConfig(variants={"density": {"double": {"density": 2.0}}}).settings()
    assert set(_altered(tmp_path / "altered", settings, parts)["density: double"]) == set(names)
