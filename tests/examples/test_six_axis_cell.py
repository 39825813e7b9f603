"""The example package, installed into a folder of its own: its devices pass the contracts and plan."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from mskgrasp.plan.__main__ import main
from tests.programs import run_here

REPOSITORY = Path(__file__).parents[2]
PACKAGE = REPOSITORY / "examples" / "six_axis_cell"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("installed")
    shutil.copytree(PACKAGE, folder / "source", ignore=shutil.ignore_patterns("__pycache__"))
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    options = ["--no-deps", "--no-index", "--no-build-isolation", "--target", str(folder / "site")]
    subprocess.run([*pip, *options, str(folder / "source")], check=True, capture_output=True, timeout=200)
    return folder / "site"


def python(site: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": f"{site}{os.pathsep}{REPOSITORY}"},
        capture_output=True,
        text=True,
        timeout=300,
    )


@pytest.mark.slow
def test_its_own_tests_pass_the_contracts_of_arms_and_cameras(site: Path):
    tests = site.parent / "source"
    done = python(site, tests, "-m", "pytest", "-q", "-W", "error", "-c", "pyproject.toml", "tests")
    assert done.returncode == 0, done.stdout + done.stderr
    assert " passed" in done.stdout and "skipped" not in done.stdout


@pytest.mark.slow
def test_a_grasp_is_planned_in_its_cell_without_any_simulator(site: Path, tmp_path: Path):
    code = (
        "import sys; sys.modules['sapien'] = sys.modules['mani_skill'] = None\n"
        "from mskgrasp.plan.__main__ import main; sys.exit(main())"
    )
    done = python(site, tmp_path, "-c", code, "--cell", str(PACKAGE / "cell.yaml"), "--out", "plan")
    assert done.returncode == 0, done.stderr
    plan = json.loads((tmp_path / "plan" / "plan.json").read_text())
    assert plan["quality"] > 0.9


def test_the_doctor_names_the_package_of_each_device(site: Path, tmp_path: Path):
    done = python(site, tmp_path, "-m", "hal.doctor", "--cell", str(PACKAGE / "cell.yaml"))
    assert "driver six_axis" in done.stdout and "package six-axis-cell 1.0" in done.stdout, done.stderr


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("driver: six_axis", "driver: seven_axis", "replay (built in), six_axis (package six-axis-cell 1.0)"),
        ("driver: six_axis", "driver: six_axis, pase: 2", "unknown key 'pase'; legal keys here: pace"),
        (", 0.0, 0.0]  #", ", 0.0, 0.0, 0.0]  #", "workspace.home has 7 joints, the arm has 6"),
        ("grasp_force: 25", "grasp_force: 60", "grasp_force 60 N is outside 5 .. 40 N"),
    ],
)
def test_a_wrong_file_is_one_line_and_exit_code_2(
    site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: str, new: str, message: str
):
    monkeypatch.syspath_prepend(site)
    monkeypatch.chdir(tmp_path)
    text = (PACKAGE / "cell.yaml").read_text()
    assert old in text
    Path("cell.yaml").write_text(text.replace(old, new))
    done = run_here(main, "--cell", "cell.yaml", "--out", "plan")
    assert done.returncode == 2 and message in done.stderr, done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not Path("plan", "plan.json").exists()
