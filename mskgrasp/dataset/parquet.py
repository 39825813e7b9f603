"""Export of a dataset for publication: one Parquet file with images, and a card beside it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.core.grasp import FAILURES
from mskgrasp.dataset.attempts import COLUMNS, Attempts, ShardInfo
from mskgrasp.dataset.card import markdown, read_card
from mskgrasp.dataset.export import Watch, check_export_path, renamed_at_the_end, same_settings
from mskgrasp.dataset.shards import SCHEMA_VERSION, list_shards, read_shard

if TYPE_CHECKING:
    import pyarrow

CARD = "README.md"
ROWS_A_GROUP = 1000
"""Rows that a reader loads at once."""
_FRONT_MATTER = """---
license: {licence}
pretty_name: {name}
task_categories: [robotics]
configs:
- config_name: default
  data_files: {file}
---

"""
_LAYOUT = """
## Layout

A row of `{file}` is an attempt. `depth` is a PNG of 16 bits in units of 0.1 mm along the optical axis, 0
where invalid; what only a held part has is null where the grasp failed. Units and frames of the other columns
are in the metadata of each field; camera, region, physics and drawn errors in that of the schema, as JSON
under `mskgrasp`.
"""


def export_parquet(folder: Path, out: Path, watch: Watch = iter, *, licence: str = "apache-2.0") -> int:
    """Write all attempts of a dataset into one Parquet file, and its card into ``README.md`` beside it.

    The card begins as the Hugging Face Hub expects it. Only some shards are in memory at a time.

    Args:
        folder: The dataset.
        out: The file; its folder must hold no ``README.md``.
        watch: Yields the shards that are read.
        licence: Identifier on the card.

    Returns:
        The number of attempts.

    Raises:
        BadDataset: A shard is damaged, or the shards do not belong together.
        UsageError: A file exists or cannot be made, or pyarrow is not installed.
    """
    try:
        import pyarrow.parquet as pq
    except ImportError as error:
        raise UsageError("--format parquet needs pyarrow: run EXTRAS=dev,parquet .ci/setup") from error
    card = out.parent / CARD
    if card.exists():
        raise UsageError(f"--out: {card} exists, and is not overwritten; choose another folder or delete it")
    files = [*check_export_path(folder, out, ".parquet"), card]
    schema = _schema(read_shard(list_shards(folder)[0])[1])
    n = 0
    with renamed_at_the_end(out.parent, files) as temporary:
        with _named(out), pq.ParquetWriter(temporary / out.name, schema, compression="zstd") as file:
            for table in _groups(folder, schema, watch):
                file.write_table(table)
                n += table.num_rows
        name, file_name = (json.dumps(text) for text in (folder.resolve().name, out.name))  # legal in YAML
        text = _FRONT_MATTER.format(licence=licence, name=name, file=file_name)
        text += markdown(read_card(folder)) + _LAYOUT.format(file=out.name)
        (temporary / CARD).write_text(text, encoding="utf-8")
    return n


@contextmanager
def _named(out: Path) -> Iterator[None]:
    """Arrow's errors of a full disk do not name the file."""
    try:
        yield
    except OSError as error:
        if error.filename is not None:
            raise
        raise OSError(error.errno, error.strerror or str(error), str(out)) from error


def _schema(info: ShardInfo) -> pyarrow.Schema:
    import pyarrow as pa

    kinds = {
        "float32": pa.float32(), "bool": pa.bool_(), "int32": pa.int32(),
    }  # fmt: skip
    columns = [
        pa.field("part", pa.string()),
        pa.field("family", pa.string()),
        pa.field("part_hash", pa.string()),
        pa.field("depth", pa.struct([("bytes", pa.binary()), ("path", pa.string())])),
    ]
    for name, column in COLUMNS.items():
        if name == "depth":
            continue
        kind = pa.string() if name == "failure" else kinds[column.dtype]
        if column.shape:
            kind = pa.list_(kind, column.shape[0])
        about = {} if name == "failure" else {"unit": column.unit, "frame": column.frame}
        columns.append(pa.field(name, kind, metadata=about))
    shared = {
        "schema_version": SCHEMA_VERSION,
        "failures": FAILURES,
        "intrinsics": np.asarray(info.intrinsics).tolist(),
        "T_base_camera": np.asarray(info.T_base_camera.as_vector()).tolist(),
        "table_z": info.table_z,
        "region": info.region,
        "physics": info.physics,
        "noise": info.noise,
        "seed": info.seed,
        "planner": info.planner,
    }
    return pa.schema(columns, metadata={"mskgrasp": json.dumps(shared)})


def _groups(folder: Path, schema: pyarrow.Schema, watch: Watch) -> Iterator[pyarrow.Table]:
    import pyarrow as pa

    tables: list[Any] = []
    first: list[ShardInfo] = []
    for path in watch(list_shards(folder)):
        attempts, info = read_shard(path)
        same_settings(path, info, first)
        first = first or [info]
        tables.append(_table(attempts, info, schema, path))
        if sum(table.num_rows for table in tables) >= ROWS_A_GROUP:
            yield pa.concat_tables(tables).combine_chunks()
            tables = []
    if tables:
        yield pa.concat_tables(tables).combine_chunks()


def _table(attempts: Attempts, info: ShardInfo, schema: pyarrow.Schema, path: Path) -> pyarrow.Table:
    import pyarrow as pa

    n = len(attempts.success)
    values: dict[str, Any] = {
        "part": [info.part] * n,
        "family": [info.family] * n,
        "part_hash": [info.part_hash] * n,
        "depth": [{"bytes": _png(image, path), "path": None} for image in attempts.depth],
        "failure": [FAILURES[code] for code in attempts.failure],
    }
    for name, column in COLUMNS.items():
        if name not in values:
            rows = getattr(attempts, name)
            missing = np.zeros(n, bool) if column.finite != "successful" else ~attempts.success
            if column.dtype == "float32":
                missing = missing | np.isnan(rows).any(axis=tuple(range(1, rows.ndim)))
            values[name] = [None if gone else row.tolist() for row, gone in zip(rows, missing, strict=True)]
    return pa.Table.from_pydict(values, schema=schema)


def _png(image: np.ndarray, path: Path) -> bytes:
    done, data = cv2.imencode(".png", image)
    if not done:
        raise BadDataset(f"{path}: an image of shape {image.shape} cannot be encoded; collect it again")
    return data.tobytes()
