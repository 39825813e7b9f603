"""Command line of the dataset program."""

from __future__ import annotations

import pytest

import tasks  # noqa: F401 (registers the task)
from mskgrasp.dataset.commands.command_line import main
from tests.programs import run_here


@pytest.mark.parametrize(("form", "name"), [("npz", "data.npz"), ("maniskill", "data.h5")])
def test_nothing_is_overwritten(collected, tmp_path, form, name):
    (tmp_path / name).write_text("precious")
    done = run_here(main, "export", str(collected), "--format", form, "--out", str(tmp_path / name))
    assert done.returncode == 2 and "exists" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text() == "precious"
