"""Folders of runs: resumed with the same inputs and scenes, refused with others."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from mskgrasp.core.config import Config
from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.runtime.run_folder import INPUTS, SETTINGS, opened_run


class Settings(Config):
    """Settings of a run."""

    seed: int = 0
    trials: int = 1


def open_run(out: Path, *, seed: int = 0, trials: int = 1, model: str = "a", **changes: Any) -> None:
    values: dict[str, Any] = dict(scene_version=1, may_change=("trials",)) | changes
    with opened_run(Settings(seed=seed, trials=trials), out, {"model": model}, **values):
        pass


def test_a_run_is_resumed_with_a_setting_that_may_change(tmp_path: Path):
    open_run(tmp_path)
    open_run(tmp_path, trials=5)
    assert "trials: 5" in (tmp_path / SETTINGS).read_text()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(seed=1), "seed differ"),
        (dict(model="b"), "model differ"),
        (dict(scene_version=2), "scenes of version 1, this program draws version 2: .* another --out"),
    ],
)
def test_a_run_of_another_seed_input_or_scene_version_is_refused_and_left_as_it_was(
    tmp_path: Path, changes: dict[str, Any], message: str
):
    open_run(tmp_path)
    before = {path.name: path.read_text() for path in tmp_path.iterdir()}
    with pytest.raises(UsageError, match=message) as raised:
        open_run(tmp_path, trials=5, **changes)
    assert "\n" not in str(raised.value)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == before


def test_a_folder_without_a_scene_version_counts_as_version_1(tmp_path: Path):
    open_run(tmp_path)
    inputs = json.loads((tmp_path / INPUTS).read_text())
    del inputs["scene_version"]
    (tmp_path / INPUTS).write_text(json.dumps(inputs))
    with pytest.raises(UsageError, match="version 1, this program draws version 2"):
        open_run(tmp_path, scene_version=2)
    open_run(tmp_path)
    assert json.loads((tmp_path / INPUTS).read_text()) == {"model": "a", "scene_version": 1}


@pytest.mark.parametrize("text", ["", "[]", '{"model": '])
def test_a_damaged_record_of_inputs_is_an_error_of_one_line(tmp_path: Path, text: str):
    open_run(tmp_path)
    (tmp_path / INPUTS).write_text(text)
    with pytest.raises(BadDataset, match="inputs.json is not a record of a run's inputs") as raised:
        open_run(tmp_path)
    assert "\n" not in str(raised.value)


def test_a_run_in_progress_keeps_its_settings_when_a_second_one_is_refused(tmp_path: Path):
    with opened_run(Settings(trials=2), tmp_path, {}, scene_version=1, may_change=("trials",)):
        with pytest.raises(UsageError, match="another run is writing"):
            open_run(tmp_path, trials=9)
        assert "trials: 2" in (tmp_path / SETTINGS).read_text()


def test_a_folder_with_other_files_is_refused(tmp_path: Path):
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(UsageError, match="holds other files"):
        open_run(tmp_path)
