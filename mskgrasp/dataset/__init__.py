"""Datasets of grasp attempts in HDF5 shards, and the program ``python -m mskgrasp.dataset``."""

from mskgrasp.dataset.attempts import DEPTH_UNIT, Attempts, ShardInfo, depth_to_u16, u16_to_depth
from mskgrasp.dataset.dataset import Dataset, open_dataset
from mskgrasp.dataset.shards import (
    SCHEMA_VERSION,
    list_shards,
    read_columns,
    read_shard,
    read_success,
    shard_path,
    write_shard,
)

__all__ = [
    "DEPTH_UNIT",
    "Dataset",
    "open_dataset",
    "SCHEMA_VERSION",
    "Attempts",
    "ShardInfo",
    "depth_to_u16",
    "list_shards",
    "read_columns",
    "read_shard",
    "read_success",
    "shard_path",
    "u16_to_depth",
    "write_shard",
]
