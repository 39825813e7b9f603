"""The collector as a program, with a configuration small enough for tests."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import yaml

from mskgrasp.dataset import list_shards, read_shard

REPOSITORY = Path(__file__).parents[1]
PARTS = ["parallel_key_a16x10x56", "hex_nut_m30"]


def arguments(out: Path, *options: str) -> list[str]:
    config = out.parent / "small.yaml"
    config.write_text(yaml.safe_dump(dict(parts=PARTS, attempts_per_part=6, shard_size=3, seed=5)))
    return ["--config", str(config), "--out", str(out), *options]


def command(out: Path, *options: str) -> list[str]:
    return [sys.executable, "-m", "mskgrasp.collect", *arguments(out, *options)]


def collect(out: Path, *options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command(out, *options), capture_output=True, text=True, cwd=REPOSITORY, timeout=280)


def assert_equal(first: Path, second: Path) -> None:
    """Both datasets hold the same shards, byte by byte."""
    names = [path.name for path in list_shards(first)]
    assert names == [path.name for path in list_shards(second)]
    for name in names:
        one, two = (read_shard(folder / "shards" / name)[0] for folder in (first, second))
        for column, values in vars(one).items():
            assert np.array_equal(values, vars(two)[column], equal_nan=values.dtype.kind == "f"), column
        assert (first / "shards" / name).read_bytes() == (second / "shards" / name).read_bytes()
