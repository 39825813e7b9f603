"""The folder of a run: resumed with the same inputs only, and never left with half a file."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from mskgrasp.core.config import Config
from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.runtime.run_folder import TRIALS, append, begin, file_digest, read, rewrite


class RunConfig(Config):
    """Settings of a run."""

    seed: int = 0
    n_parts: int = 3


def open_run(out: Path, config: RunConfig | None = None, **inputs: str) -> None:
    begin(config or RunConfig(), out, inputs or {"model": "a"}, may_change=("n_parts",))


def test_a_run_is_resumed_with_the_same_inputs_and_may_grow(tmp_path: Path):
    open_run(tmp_path / "run")
    open_run(tmp_path / "run", RunConfig(n_parts=9))
    open_run(tmp_path / "run", model="a", washer_m36="b")  # of the parts that were added


@pytest.mark.parametrize(
    "config, inputs, differs",
    [
        (RunConfig(seed=1), {"model": "a"}, "seed"),
        (RunConfig(), {"model": "b"}, "model"),
        (RunConfig(seed=1), {"model": "b"}, "seed, model"),
    ],
)
def test_a_run_with_other_inputs_is_refused(
    tmp_path: Path, config: RunConfig, inputs: dict[str, str], differs: str
):
    open_run(tmp_path / "run")
    with pytest.raises(UsageError, match=rf"other inputs \({differs} differ\)"):
        open_run(tmp_path / "run", config, **inputs)


def test_an_input_that_joined_later_is_remembered(tmp_path: Path):
    open_run(tmp_path / "run", model="a")
    open_run(tmp_path / "run", model="a", washer_m36="b")
    open_run(tmp_path / "run", model="a")
    with pytest.raises(UsageError, match="washer_m36 differ"):
        open_run(tmp_path / "run", model="a", washer_m36="c")


def test_a_folder_with_other_files_is_not_touched(tmp_path: Path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(UsageError, match="holds other files"):
        open_run(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_lines_come_back_in_order_and_nan_is_refused(tmp_path: Path):
    path = tmp_path / TRIALS
    assert read(path, dict) == []
    for number in range(3):
        append(path, {"number": number})
    with pytest.raises(ValueError, match="JSON compliant"):
        append(path, {"error": float("nan")})
    assert [line["number"] for line in read(path, dict)] == [0, 1, 2]
    rewrite(path, reversed(read(path, dict)))
    assert [line["number"] for line in read(path, dict)] == [2, 1, 0]


def test_an_incomplete_line_is_removed_by_replacing_the_file(tmp_path: Path):
    path, before = tmp_path / TRIALS, tmp_path / "before"
    path.write_text('{"number": 0}\n{"num')
    os.link(path, before)  # keeps the old content only if the file is not written to in place
    assert read(path, dict) == [{"number": 0}]
    assert path.read_text() == '{"number": 0}\n' and before.read_text().endswith('{"num')


def test_a_line_that_is_no_trial_is_named(tmp_path: Path):
    path = tmp_path / TRIALS
    path.write_text('{"number": 0}\nnonsense\n')
    with pytest.raises(BadDataset, match="line 2 is not a trial"):
        read(path, dict)


def test_a_digest_is_of_the_content_and_a_missing_file_is_an_error(tmp_path: Path):
    for name, content in (("a", b"one"), ("b", b"one"), ("c", b"two")):
        (tmp_path / name).write_bytes(content)
    a, b, c = (file_digest(tmp_path / name) for name in "abc")
    assert a == b != c
    with pytest.raises(UsageError, match="cannot read"):
        file_digest(tmp_path / "d")
