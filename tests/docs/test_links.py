"""Existence of everything that pages name: linked files and headings, modules, files, tests, imports."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

from tests.docs.notebooks import notebooks, page_text
from tests.docs.pages import ROOT, anchors, links, pages

PAGES = pytest.mark.parametrize(
    "page", [*pages(), *notebooks()], ids=lambda page: str(page.relative_to(ROOT))
)
OWN = r"(?:mskgrasp|hal|tasks|tests)"
ENTRY_POINTS = {"mskgrasp.cells", "mskgrasp.planners", "mskgrasp.arms", "mskgrasp.cameras"}


@PAGES
def test_every_relative_link_and_image_resolves(page: Path):
    for link in links(page_text(page)):
        if "://" in link or link.startswith("mailto:"):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{link}: no such file"
        assert ROOT in target.parents, f"{link}: leads out of the repository"
        if anchor:
            assert anchor in anchors(page_text(target)), f"{link}: no such heading"


@PAGES
def test_every_command_names_a_module_that_runs(page: Path):
    for module in re.findall(rf"-m ({OWN}[\w.]*)", page_text(page)):
        path = ROOT / module.replace(".", "/")
        assert path.with_suffix(".py").is_file() or (path / "__main__.py").is_file(), f"no module {module}"


@PAGES
def test_every_module_named_in_code_exists(page: Path):
    for name in re.findall(rf"`({OWN}(?:\.\w+)+)", page_text(page)):
        assert name in ENTRY_POINTS or _exists(name), f"no {name}"


@PAGES
def test_every_source_file_named_in_code_exists(page: Path):
    for path in re.findall(rf"`((?:{OWN}|configs|docs|\.ci)/[\w./-]+)`", page_text(page)):
        assert (ROOT / path).exists(), f"no {path}"


@PAGES
def test_every_test_named_in_code_exists(page: Path):
    names = set(re.findall(r"`(test_\w+)`", page_text(page)))
    if names:
        source = "\n".join(path.read_text(encoding="utf-8") for path in ROOT.glob("tests/**/test_*.py"))
        assert not [name for name in names if f"def {name}(" not in source]


@PAGES
def test_every_target_of_make_exists(page: Path):
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    text = page_text(page)
    for target in re.findall(r"(?:`|^ {4})make ([a-z][a-z-]+)", text, flags=re.M):
        assert re.search(rf"^{target}:", makefile, flags=re.M), f"no target {target}"


@PAGES
def test_every_import_in_an_example_resolves(page: Path):
    lines = re.findall(rf"^ *from ({OWN}[\w.]*) import (.*)$", page_text(page), flags=re.M)
    for module, names in lines:
        found = importlib.import_module(module)
        assert not [name for name in re.findall(r"\w+", names) if not hasattr(found, name)]


def _exists(name: str) -> bool:
    path = ROOT
    parts = name.split(".")
    for number, part in enumerate(parts):
        path = path / part
        if path.with_suffix(".py").is_file():
            text = path.with_suffix(".py").read_text(encoding="utf-8")
            return all(re.search(rf"\b{rest}\b", text) for rest in parts[number + 1 :])
        if not path.is_dir():
            init = path.parent / "__init__.py"
            return init.is_file() and re.search(rf"\b{part}\b", init.read_text(encoding="utf-8")) is not None
    return True


def test_every_page_named_in_source_exists():
    sources = [
        path for pattern in ("mskgrasp", "hal", "tasks", "configs") for path in (ROOT / pattern).rglob("*.*")
    ]
    named = {
        name
        for path in sources
        if path.suffix in (".py", ".yaml")
        for name in re.findall(r"docs/[\w/]+\.(?:md|png|csv)", path.read_text(encoding="utf-8"))
    }
    assert named and not [name for name in named if not (ROOT / name).exists()]
