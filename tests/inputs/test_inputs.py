"""Malformed inputs of every program: one line that says what is wrong, and the right exit code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mskgrasp.core.errors import MOST_CHARACTERS
from mskgrasp.runtime.programs import PROGRAMS
from tests.inputs import cad_files, configurations, datasets, models, options, runs
from tests.inputs.row import Place, Row
from tests.programs import run_here

ROWS = [row for module in (configurations, options, models, datasets, cad_files, runs) for row in module.ROWS]
PREFIX = 100
"""Characters of the program's name and the words before a message."""


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("shared")


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row.program}: {row.name}")
def test_a_malformed_input_is_one_line_with_the_cause(
    row: Row, shared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    if row.program == "parts":
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    ended = run_here(row.main(), *row.arguments(Place(tmp_path, shared)))
    assert ended.returncode == row.code, ended.stderr
    assert re.search(row.says, ended.stderr), ended.stderr
    lines = ended.stderr.splitlines()
    assert ended.stderr.endswith("\n") and (len(lines) == 1 or row.also and lines)
    assert all(line.isprintable() and len(line) <= MOST_CHARACTERS + PREFIX for line in lines)


def test_every_program_is_given_malformed_inputs():
    assert {row.program for row in ROWS} == set(PROGRAMS) and len(ROWS) >= 60
