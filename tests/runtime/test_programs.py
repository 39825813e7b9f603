"""Programs and the pages about them."""

from __future__ import annotations

import ast
import importlib
import inspect
import itertools
import json
import subprocess
import sys
import textwrap
from importlib.util import find_spec
from pathlib import Path
from typing import get_args

import pytest
from pydantic import BaseModel

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


@pytest.mark.parametrize("name", [name for name, one in PROGRAMS.items() if ".config:" in one.options])
def test_every_option_says_what_it_sets(name: str):
    module, _, config = PROGRAMS[name].options.partition(":")
    unsaid = [
        f"{one.__name__}.{field}"
        for one in sorted(settings_in(getattr(importlib.import_module(module), config)), key=str)
        for field in set(one.__annotations__) - documented(one)
        if field in one.model_fields
    ]
    assert not unsaid


def settings_in(config: type[BaseModel]) -> set[type[BaseModel]]:
    """A class of settings, its bases, and those of its fields."""
    found = {
        one for one in config.__mro__ if issubclass(one, BaseModel) and one.__module__ != "pydantic.main"
    }
    for field in config.model_fields.values():
        for one in (field.annotation, *get_args(field.annotation)):
            if isinstance(one, type) and issubclass(one, BaseModel):
                found |= settings_in(one)
    return found


def documented(config: type[BaseModel]) -> set[str]:
    """Fields of a class that are followed by a docstring."""
    (tree,) = ast.parse(textwrap.dedent(inspect.getsource(config))).body
    assert isinstance(tree, ast.ClassDef)
    return {
        node.target.id
        for node, after in itertools.pairwise(tree.body)
        if isinstance(node, ast.AnnAssign)
        and isinstance(node.target, ast.Name)
        and isinstance(after, ast.Expr)
        and isinstance(after.value, ast.Constant)
    }
