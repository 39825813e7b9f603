"""Fixtures of datasets."""

from __future__ import annotations

from pathlib import Path

import pytest

from mskgrasp.dataset import Attempts, list_shards, read_shard


@pytest.fixture(scope="session")
def joined(collected: Path) -> Attempts:
    """All attempts of the small dataset."""
    return Attempts.concatenate([read_shard(path)[0] for path in list_shards(collected)])
