"""Programs and the pages about them."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

from mskgrasp.runtime.programs import GROUPS, PROGRAMS, guide

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", PROGRAMS)
def test_the_page_of_a_program_exists_and_shows_how_to_run_it(name: str):
    program = PROGRAMS[name]
    page = (ROOT / program.page).read_text(encoding="utf-8")
    assert f"-m {program.module}" in page or f"mskgrasp {name}" in page
    assert find_spec(program.module) is not None
    assert program.page in guide(f"python -m {program.module} verb")


def test_every_program_of_the_packages_is_listed():
    mains = {
        path.parent for package in ("mskgrasp", "hal") for path in (ROOT / package).glob("*/__main__.py")
    }
    assert {f"{path.parent.name}.{path.name}" for path in mains} == {one.module for one in PROGRAMS.values()}
    assert sum(map(len, GROUPS.values())) == len(PROGRAMS)


def test_another_program_has_no_page():
    assert guide("program") == ""
