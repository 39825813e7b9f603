"""The wheel, installed away from the checkout."""

from __future__ import annotations

import json
import os
import shutil
import site
import subprocess
import sys
import venv
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
SOURCES = ("pyproject.toml", "README.md", "LICENSE", "configs", "mskgrasp", "hal", "tasks")


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fresh environment's folder of programs: the wheel, and the dependencies of the tests' environment."""
    folder = tmp_path_factory.mktemp("wheel")
    sources = folder / "sources"  # a build leaves files beside the sources, and packages what an earlier left
    sources.mkdir()
    for name in SOURCES:
        if (REPOSITORY / name).is_dir():
            ignore = shutil.ignore_patterns("__pycache__")
            shutil.copytree(REPOSITORY / name, sources / name, symlinks=True, ignore=ignore)
        else:
            shutil.copy(REPOSITORY / name, sources)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    options = ["--quiet", "--no-deps", "--no-index"]
    wheels = folder / "wheels"
    _run([*pip, "wheel", *options, "--no-build-isolation", "-w", str(wheels), str(sources)], folder)
    venv.create(folder / "venv", with_pip=False)
    programs = folder / "venv" / "bin"
    (wheel,) = wheels.glob("*.whl")
    _run([*pip, "--python", str(programs / "python"), "install", *options, str(wheel)], folder)
    (packages,) = (folder / "venv").glob("lib/python*/site-packages")
    # Of a folder named in a .pth file the .pth files are not read: an editable install there stays out.
    (packages / "dependencies.pth").write_text("\n".join(site.getsitepackages()) + "\n")
    return programs


def _run(command: list[str], folder: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run(
        command, cwd=folder, env=clean | variables, capture_output=True, text=True, timeout=400
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done


def test_the_installed_package_knows_nothing_of_the_checkout(installed, tmp_path):
    code = (
        "import hal, mskgrasp, tasks; from mskgrasp.core.shipped import config_file; "
        "print(hal.__file__, mskgrasp.__file__, tasks.__file__, config_file('cells/sapien.yaml'))"
    )
    paths = [Path(text) for text in _run([str(installed / "python"), "-c", code], tmp_path).stdout.split()]
    assert all(path.is_relative_to(installed.parent) and path.is_file() for path in paths)


def test_every_shipped_file_is_in_the_wheel(installed):
    (packages,) = installed.parent.glob("lib/python*/site-packages")
    for name in ("hal", "mskgrasp", "tasks"):
        files = (path for path in (REPOSITORY / name).rglob("*") if path.is_file())
        shipped = {path.relative_to(REPOSITORY) for path in files if "__pycache__" not in path.parts}
        assert shipped and [path for path in shipped if not (packages / path).is_file()] == []
    for path in (REPOSITORY / "configs").rglob("*.yaml"):
        assert (packages / "mskgrasp" / path.relative_to(REPOSITORY)).read_bytes() == path.read_bytes()


@pytest.mark.slow
def test_a_shipped_example_is_planned_from_an_empty_folder(installed, tmp_path):
    folder = tmp_path / "empty"
    folder.mkdir()
    command = [str(installed / "mskgrasp"), "plan", "--part", "bracket.stl"]
    done = _run(command, folder, XDG_CACHE_HOME=str(tmp_path / "cache"))
    assert "bracket.stl is not in this folder: using the shipped example" in done.stdout
    assert 0 < json.loads((folder / "out" / "plan" / "plan.json").read_text())["quality"] <= 1
    assert (folder / "out" / "plan" / "plan.png").stat().st_size > 0


def test_programs_find_their_shipped_settings_from_an_empty_folder(installed, tmp_path):
    """One after the other in one process, which imports torch and the simulator once."""
    code = """
import sys
from mskgrasp.__main__ import main

for program in ("collect", "train", "evaluate", "palletize", "validate"):
    sys.argv = ["mskgrasp", program, "--help"]
    try:
        main()
    except SystemExit as ended:
        print(program, ended.code)
"""
    printed = _run([str(installed / "python"), "-c", code], tmp_path).stdout
    assert printed.count("usage: ") == 5
    for program in ("collect", "train", "evaluate", "palletize", "validate"):
        assert f"\n{program} 0\n" in printed
