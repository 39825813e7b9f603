"""State of long runs: what is kept, and what is refused."""

from __future__ import annotations

import json
import lzma
from pathlib import Path

import pytest

from mskgrasp.core.errors import BadDataset, UsageError
from tests.docs.kept_runs import keep, restore


def test_a_restored_run_has_settings_inputs_and_whole_trials_and_no_frames(tmp_path: Path):
    out = tmp_path / "out"
    (out / "trials").mkdir(parents=True)
    (out / "trials" / "nut-000.npz").write_bytes(b"frame")
    files = {"config.yaml": "seed: 0\n", "inputs.json": "{}\n", "cell.yaml": "type: sapien\n"}
    for name, text in files.items():
        (out / name).write_text(text)
    (out / "trials.jsonl").write_text('{"part": "nut"}\n{"part": "bo')
    assert keep(out, tmp_path / "kept" / "run.json.xz") == 1
    assert restore(tmp_path / "kept" / "run.json.xz", tmp_path / "again") == 1
    found = {path.name: path.read_text() for path in (tmp_path / "again").iterdir()}
    assert found == {**files, "trials.jsonl": '{"part": "nut"}\n'}
    with pytest.raises(UsageError, match="exists; move it away"):
        restore(tmp_path / "kept" / "run.json.xz", tmp_path / "again")


def test_what_is_no_run_is_not_kept_and_what_is_no_state_is_not_restored(tmp_path: Path):
    with pytest.raises(UsageError, match="no run in"):
        keep(tmp_path, tmp_path / "run.json.xz")
    with pytest.raises(UsageError, match="keep the run first"):
        restore(tmp_path / "run.json.xz", tmp_path / "out")
    whole = lzma.compress(b"{}")
    for content in (
        b"{}",
        whole[:-9],
        lzma.compress(json.dumps({"../x": ""}).encode()),
        lzma.compress(b"[1]"),
    ):
        (tmp_path / "run.json.xz").write_bytes(content)
        with pytest.raises(BadDataset, match="not the state of a run"):
            restore(tmp_path / "run.json.xz", tmp_path / "out")
        assert not (tmp_path / "out").exists()
