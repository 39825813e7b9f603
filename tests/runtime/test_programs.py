"""Programs and the pages about them."""

from __future__ import annotations

import json
import subprocess
import sys
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


def test_options_load_neither_networks_nor_meshes_nor_a_simulator():
    modules = [one.options.partition(":")[0] for one in PROGRAMS.values()]
    program = (
        "import importlib, json, sys; [importlib.import_module(one) for one in sys.argv[1:]]; "
        "print(json.dumps(sorted(sys.modules)))"
    )
    configs = [one for one in modules if one.endswith(".config")]
    done = subprocess.run(
        [sys.executable, "-c", program, "mskgrasp.runtime.options", *configs],
        capture_output=True,
        text=True,
        check=True,
    )
    loaded = set(json.loads(done.stdout))
    assert len(configs) > 10 and loaded >= set(configs)
    assert not loaded & {"matplotlib", "mani_skill", "mujoco", "sapien", "torch", "trimesh"}
