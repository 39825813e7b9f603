"""Digest of a dataset's grasps and outcomes, by which a training recognises its data."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from mskgrasp.dataset.shards import list_shards, read_columns

OUTCOMES = ("grasp", "success", "displacement")
"""Arrays of a shard that enter the digest, in this order."""


def dataset_fingerprint(folder: Path, watch: Callable[[Sequence[Path]], Iterable[Path]] = iter) -> str:
    """Hex digest of the outcomes of all shards, read without their images.

    Args:
        folder: Folder of the dataset.
        watch: Yields each of the files that will be read; may show a progress bar.

    Raises:
        MissingDataset: There is no dataset in the folder.
        BadDataset: A shard is damaged.
    """
    digest = hashlib.sha256()
    for path in watch(list_shards(folder)):
        arrays, _ = read_columns(path, OUTCOMES)
        for name in OUTCOMES:
            digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.hexdigest()
