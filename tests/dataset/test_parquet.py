"""A published dataset holds every column, its units, its images, and a card."""

from __future__ import annotations

import errno
import json
import shutil

import cv2
import numpy as np
import pyarrow.parquet
import pytest
import yaml

from mskgrasp.core.errors import UsageError
from mskgrasp.core.grasp import FAILURES
from mskgrasp.dataset import Attempts, list_shards, read_shard, write_shard
from mskgrasp.dataset.attempts import COLUMNS
from mskgrasp.dataset.commands.command_line import main
from mskgrasp.dataset.parquet import export_parquet


def test_parquet_holds_every_column_with_units_images_and_a_card(collected, joined, tmp_path):
    out = tmp_path / "public" / "data.parquet"
    assert main(["export", str(collected), "--format", "parquet", "--out", str(out)]) == 0
    table = pyarrow.parquet.read_table(out)
    assert table.num_rows == 12
    for name, values in vars(joined).items():
        rows = table[name].to_pylist()
        if name == "depth":
            images = [
                cv2.imdecode(np.frombuffer(row["bytes"], np.uint8), cv2.IMREAD_UNCHANGED) for row in rows
            ]
            assert np.array_equal(images, values)
        elif name == "failure":
            assert rows == [FAILURES[code] for code in values]
        else:
            if COLUMNS[name].finite == "successful":
                assert [row is None for row in rows] == list(~joined.success), name
                values = np.where(joined.success.reshape(-1, *[1] * (values.ndim - 1)), values, np.nan)
            empty = np.full(values.shape[1:], np.nan)
            found = np.array([empty if row is None else row for row in rows], values.dtype)
            assert np.array_equal(found, values, equal_nan=values.dtype.kind == "f"), name
    infos = [read_shard(path)[1] for path in list_shards(collected)]
    shared = json.loads(table.schema.metadata[b"mskgrasp"])
    assert shared["physics"] == infos[0].physics and shared["seed"] == 5
    assert np.array_equal(shared["intrinsics"], infos[0].intrinsics)
    assert table.schema.field("tilt").metadata == {b"unit": b"rad", b"frame": b"grasp"}
    card = (out.parent / "README.md").read_text()
    head, rest = card.removeprefix("---\n").split("---\n", 1)
    described = yaml.safe_load(head)
    assert described["configs"][0]["data_files"] == "data.parquet"
    assert described["pretty_name"] == collected.name
    assert "| attempts | 12 |" in rest and "## Layout" in rest
    first, *_ = list_shards(collected)
    copy = tmp_path / "discarded" / "shards"
    shutil.copytree(collected, copy.parent)
    attempts, info = read_shard(first)
    nothing = Attempts(**{name: values[:0] for name, values in vars(attempts).items()})
    write_shard(copy / first.name, nothing, info)
    export_parquet(copy.parent, tmp_path / "discarded.parquet")
    assert pyarrow.parquet.read_table(tmp_path / "discarded.parquet").num_rows == 12 - len(attempts)
    with pytest.raises(UsageError, match=r"README\.md exists, and is not overwritten"):
        export_parquet(collected, out.with_name("other.parquet"))


def test_a_full_disk_is_an_error_that_names_the_file(collected, tmp_path, monkeypatch):
    """Arrow's errors do not name it."""

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(pyarrow.parquet.ParquetWriter, "write_table", full)
    with pytest.raises(OSError, match=r"No space left on device: '.*a\.parquet'"):
        export_parquet(collected, tmp_path / "a.parquet", licence="cc0-1.0")
    assert list(tmp_path.iterdir()) == []
