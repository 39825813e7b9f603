"""Folders of runs: resumed with the same inputs, and whole whenever a run is killed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from mskgrasp.core.config import Config
from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.runtime.run_folder import (
    INPUTS,
    TRIALS,
    append_trial,
    open_run_folder,
    read_trials,
    rewrite_trials,
)


class RunConfig(Config):
    """Settings."""

    seed: int = 0
    workers: int = 1


def _open(out: Path, inputs: dict[str, str], **settings: Any) -> None:
    open_run_folder(RunConfig(**settings), out, inputs, may_change=["workers"])


def test_a_run_is_resumed_with_the_same_inputs_only(tmp_path: Path):
    out = tmp_path / "run"
    _open(out, {"model": "a"})
    _open(out, {"model": "a", "part nut": "b"}, workers=2)
    for inputs, settings, named in (
        ({"model": "c"}, {}, "model"),
        ({"part nut": "c"}, {}, "part nut"),
        ({}, {"seed": 1}, "seed"),
    ):
        with pytest.raises(UsageError, match=named):
            _open(out, inputs, **settings)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "notes.txt").touch()
    with pytest.raises(UsageError, match="holds other files"):
        _open(tmp_path / "other", {})


def test_a_resumed_run_replaces_its_inputs_at_once(tmp_path: Path):
    _open(tmp_path, {"model": "a"})
    before = tmp_path.parent / f"{tmp_path.name}-before.json"
    os.link(tmp_path / INPUTS, before)
    _open(tmp_path, {"part nut": "b"})
    assert "nut" in (tmp_path / INPUTS).read_text() and "nut" not in before.read_text()


def test_an_incomplete_last_line_is_removed_and_the_others_stay_where_they_are(tmp_path: Path):
    path = tmp_path / TRIALS
    assert read_trials(path, dict) == []
    append_trial(path, {"n": 1})
    append_trial(path, {"n": 2})
    inode, whole = path.stat().st_ino, path.read_bytes()
    with path.open("ab") as file:
        file.write(b'{"n": "\xc3')  # a kill may also divide a character
    assert read_trials(path, dict) == [{"n": 1}, {"n": 2}]
    assert path.read_bytes() == whole and path.stat().st_ino == inode
    append_trial(path, {"n": 3})
    rewrite_trials(path, reversed(read_trials(path, dict)))
    assert [one["n"] for one in read_trials(path, dict)] == [3, 2, 1]


def test_a_line_that_is_no_trial_is_named(tmp_path: Path):
    path = tmp_path / TRIALS
    path.write_text('{"n": 1}\nn = 2\n')
    with pytest.raises(BadDataset, match="line 2 is not a trial"):
        read_trials(path, dict)
