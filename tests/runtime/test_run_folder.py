"""Folders of runs: resumed with the same inputs and scenes, refused with others."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from mskgrasp.core.config import Config
from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.runtime.run_folder import (
    INPUTS,
    SETTINGS,
    TRIALS,
    append_trial,
    file_digest,
    opened_run,
    read_trials,
    record_inputs,
    resume_trials,
    rewrite_trials,
)


class Settings(Config):
    """Settings of a run."""

    seed: int = 0
    trials: int = 1


def open_run(
    out: Path,
    *,
    seed: int = 0,
    trials: int = 1,
    inputs: Mapping[str, str] = {"model": "a"},
    scene_version: int = 1,
) -> None:
    settings = Settings(seed=seed, trials=trials)
    with opened_run(settings, out, inputs, scene_version=scene_version, may_change=("trials",)):
        pass


def test_a_run_is_resumed_with_a_setting_that_may_change(tmp_path: Path):
    open_run(tmp_path)
    open_run(tmp_path, trials=5)
    assert "trials: 5" in (tmp_path / SETTINGS).read_text()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(seed=1), "seed differ"),
        (dict(inputs={"model": "b"}), "model differ"),
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


@pytest.mark.parametrize("text", ["", "[]", '{"model": ', "[" * 100_000])
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


def test_a_run_that_was_killed_as_it_began_begins_again(tmp_path: Path):
    for number, left in enumerate(
        (["inputs.json.01.tmp"], [INPUTS], [INPUTS, "config.yaml.02.tmp", ".lock"])
    ):
        out = tmp_path / str(number)
        out.mkdir()
        for name in left:
            (out / name).write_text("")
        open_run(out)
        assert {path.name for path in out.iterdir()} == {SETTINGS, INPUTS, ".lock"}
        with pytest.raises(UsageError, match="seed differ"):
            open_run(out, seed=1)
    (tmp_path / SETTINGS).write_text("of another program")
    with pytest.raises(UsageError, match="holds other files"):
        open_run(tmp_path)


def test_a_folder_of_another_programs_run_is_refused_by_that_name(tmp_path: Path):
    (tmp_path / SETTINGS).write_text("experiment: success\n")
    (tmp_path / INPUTS).write_text("{}")
    with pytest.raises(UsageError, match=r"another program's run, .*'experiment'.*; choose another"):
        open_run(tmp_path)


def test_a_folder_with_other_files_is_refused(tmp_path: Path):
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(UsageError, match="holds other files"):
        open_run(tmp_path)


def test_an_input_that_joined_later_is_remembered(tmp_path: Path):
    open_run(tmp_path)
    open_run(tmp_path, inputs={"model": "a", "washer_m36": "b"})
    open_run(tmp_path)
    with pytest.raises(UsageError, match="washer_m36 differ"):
        open_run(tmp_path, inputs={"model": "a", "washer_m36": "c"})


def test_an_input_that_is_known_once_the_run_has_begun_is_remembered_too(tmp_path: Path):
    open_run(tmp_path)
    record_inputs(tmp_path, {"grasps of nut": "a"})
    record_inputs(tmp_path, {"grasps of nut": "a", "grasps of bolt": "b"})
    open_run(tmp_path)  # and not forgotten when the run is opened again
    with pytest.raises(UsageError, match=r"\(grasps of nut differ\); choose another --out"):
        record_inputs(tmp_path, {"grasps of nut": "c", "grasps of bolt": "b"})
    with pytest.raises(UsageError, match="model differ"):
        open_run(tmp_path, inputs={"model": "b"})


def test_lines_come_back_in_order_and_nan_is_refused(tmp_path: Path):
    path = tmp_path / TRIALS
    assert read_trials(path, dict) == []
    for number in range(3):
        append_trial(path, {"number": number})
    with pytest.raises(ValueError, match="JSON compliant"):
        append_trial(path, {"error": float("nan")})
    assert [line["number"] for line in read_trials(path, dict)] == [0, 1, 2]
    rewrite_trials(path, reversed(read_trials(path, dict)))
    assert [line["number"] for line in read_trials(path, dict)] == [2, 1, 0]


def test_an_incomplete_last_line_is_removed_by_the_run_and_the_others_stay_where_they_are(tmp_path: Path):
    path = tmp_path / TRIALS
    assert resume_trials(path, dict) == []
    append_trial(path, {"n": 1})
    append_trial(path, {"n": 2})
    inode, whole = path.stat().st_ino, path.read_bytes()
    with path.open("ab") as file:
        file.write(b'{"n": "\xc3')  # a kill may also divide a character
    assert resume_trials(path, dict) == [{"n": 1}, {"n": 2}]
    assert path.read_bytes() == whole and path.stat().st_ino == inode
    append_trial(path, {"n": 3})
    rewrite_trials(path, reversed(resume_trials(path, dict)))
    assert [one["n"] for one in resume_trials(path, dict)] == [3, 2, 1]


def test_a_reader_leaves_a_line_that_is_being_written_to_the_run_that_writes_it(tmp_path: Path):
    path = tmp_path / TRIALS
    append_trial(path, {"n": 1})
    with path.open("ab") as file:
        file.write(b'{"n": ')
        file.flush()
        assert read_trials(path, dict) == [{"n": 1}]
        file.write(b"2}\n")
    assert read_trials(path, dict) == [{"n": 1}, {"n": 2}]


def test_a_line_that_is_no_trial_is_named(tmp_path: Path):
    path = tmp_path / TRIALS
    path.write_text('{"number": 0}\nnonsense\n')
    with pytest.raises(BadDataset, match="line 2 is not a trial"):
        read_trials(path, dict)
    path.write_text(f'{{"number": 0}}\n{{"measured": [{10**400}]}}\n')
    with pytest.raises(BadDataset, match="line 2 is not a trial"):
        read_trials(path, lambda values: [float(one) for one in values.get("measured", [])])


def test_a_digest_is_of_the_content_and_a_missing_file_is_an_error(tmp_path: Path):
    for name, content in (("a", b"one"), ("b", b"one"), ("c", b"two")):
        (tmp_path / name).write_bytes(content)
    a, b, c = (file_digest(tmp_path / name) for name in "abc")
    assert a == b != c
    with pytest.raises(UsageError, match="cannot read"):
        file_digest(tmp_path / "d")
