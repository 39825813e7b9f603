"""Files at the top of the repository agree with each other."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
import yaml

import mskgrasp
from tests.docs.build_site import SITE
from tests.docs.pages import ROOT

TESTED_BY_NAME = ("hal", "mskgrasp", "tasks")
"""Packages of which every module has a test module of its name."""


def test_hooks_use_the_ruff_that_is_pinned():
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))
    (rev,) = (repo["rev"] for repo in hooks["repos"] if "ruff" in repo["repo"])
    pinned = re.search(
        r"^ruff==(.*)$", (ROOT / ".ci/constraints.txt").read_text(encoding="utf-8"), flags=re.M
    )
    assert pinned and rev == f"v{pinned[1]}"


def test_the_citation_names_this_version_and_the_paper():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == mskgrasp.__version__
    assert "1909.02129" in citation["references"][0]["url"]


def test_the_workflow_runs_what_can_be_run_here():
    workflow = yaml.safe_load((ROOT / ".github/workflows/test.yml").read_text(encoding="utf-8"))
    job = workflow["jobs"]["test"]
    assert "python:3.11" in job["container"]
    assert job["steps"][-1] == {"run": "bash .ci/run"}
    assert (ROOT / ".ci/run").stat().st_mode & 0o111


def test_the_site_is_built_and_its_folder_published_by_a_workflow_with_a_pinned_builder():
    jobs = yaml.safe_load((ROOT / ".github/workflows/docs.yml").read_text(encoding="utf-8"))["jobs"]
    steps = jobs["build"]["steps"]
    assert {"run": "make docs"} in steps
    assert ROOT / steps[-1]["with"]["path"] == SITE and jobs["publish"]["needs"] == "build"
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (builder,) = extras["optional-dependencies"]["docs"]
    assert re.search(rf"^{builder}==", (ROOT / ".ci/constraints.txt").read_text(encoding="utf-8"), flags=re.M)


def test_the_architecture_names_every_room():
    page = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    rooms = [
        init.parent for package in ("mskgrasp", "hal") for init in (ROOT / package).glob("*/__init__.py")
    ]
    assert not [str(room) for room in rooms if f"`{room.parent.name}.{room.name}`" not in page]


def test_every_package_and_every_module_of_a_package_that_is_split_stands_in_a_layer():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    layers = settings["tool"]["importlinter"]["contracts"][0]["layers"]
    named = {name for layer in layers for name in re.split(r"[ |:]+", layer)}
    split = {name.rpartition(".")[0] for name in named} - {""}
    for package in split:
        folder = ROOT / package.replace(".", "/")
        paths = [
            path for path in folder.iterdir() if path.suffix == ".py" or (path / "__init__.py").is_file()
        ]
        modules = {f"{package}.{path.stem}" for path in paths if not path.stem.startswith("__")}
        assert modules - named - split == set(), "in no layer"


@pytest.mark.parametrize("package", TESTED_BY_NAME)
def test_every_module_has_a_test_module_of_its_name_in_the_mirrored_folder(package: str):
    """``mskgrasp/a/b.py`` is tested by ``tests/a/test_b.py``, ``hal/a/b.py`` by ``tests/hal/a/test_b.py``."""
    tests = ROOT / "tests" if package == "mskgrasp" else ROOT / "tests" / package
    modules = [path.relative_to(ROOT / package) for path in (ROOT / package).rglob("*.py")]
    modules = [path for path in modules if not path.name.startswith("__")]
    assert len(modules) > 10
    without = [str(path) for path in modules if not has_tests(tests / path.with_name(f"test_{path.name}"))]
    assert not without, f"without a test module of their name: {', '.join(sorted(without))}"


def has_tests(path: Path) -> bool:
    """Whether a file holds a test."""
    return path.is_file() and bool(re.search(r"^def test_", path.read_text(encoding="utf-8"), flags=re.M))
