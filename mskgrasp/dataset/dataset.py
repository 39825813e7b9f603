"""A dataset folder as one object: its parts, shards and columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mskgrasp.core.errors import UsageError
from mskgrasp.dataset.attempts import COLUMNS, Attempts, ShardInfo
from mskgrasp.dataset.shards import list_shards, read_columns, read_shard


@dataclass(frozen=True, kw_only=True)
class Dataset:
    """The finished shards of a dataset, in the order of their names.

    Attributes:
        folder: Folder of the dataset.
        paths: Paths of the shards.
    """

    folder: Path
    paths: tuple[Path, ...]

    @property
    def part_names(self) -> tuple[str, ...]:
        """Names of the parts, sorted."""
        return tuple(sorted({path.stem.rpartition("-")[0] for path in self.paths}))

    def columns(self, *names: str) -> dict[str, np.ndarray]:
        """Some arrays of all attempts, joined; `mskgrasp.dataset.Attempts` gives shapes, units and frames.

        Args:
            names: Names of columns; none means all but the depth images.

        Returns:
            Arrays (n, ...) by name, and ``part``: (n,) names of the parts.

        Raises:
            UsageError: No column has that name.
            BadDataset: A shard is damaged.
        """
        names = names or tuple(name for name in COLUMNS if name != "depth")
        unknown = [name for name in names if name not in COLUMNS]
        if unknown:
            raise UsageError(f"no column {', '.join(unknown)}; legal: {', '.join(COLUMNS)}")
        shards = [read_columns(path, names) for path in self.paths]
        joined = {name: np.concatenate([arrays[name] for arrays, _ in shards]) for name in names}
        counts = [len(arrays[names[0]]) for arrays, _ in shards]
        return joined | {"part": np.repeat([info.part for _, info in shards], counts)}

    def shards(self, parts: Sequence[str] | None = None) -> Iterator[tuple[Attempts, ShardInfo]]:
        """Shard by shard, all columns and the attempts' shared properties; of some parts only, if named.

        Raises:
            BadDataset: A shard is damaged.
        """
        for path in self.paths:
            if parts is None or path.stem.rpartition("-")[0] in parts:
                yield read_shard(path)


def open_dataset(folder: str | Path) -> Dataset:
    """Open a dataset folder; arrays are read on demand.

    Raises:
        BadDataset: No such folder, or no finished shard in it.
    """
    folder = Path(folder)
    return Dataset(folder=folder, paths=tuple(list_shards(folder)))
