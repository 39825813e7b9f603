"""A shard as a cluster's node reports it."""

from __future__ import annotations

import errno
import os
import shutil
import socket
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from mskgrasp.collect import node as cluster_node
from mskgrasp.collect.config import CollectConfig
from mskgrasp.core.config import read_config
from mskgrasp.dataset import list_shards, read_shard
from mskgrasp.parts import find_part
from mskgrasp.parts.store import pack_part
from mskgrasp.simulation.shard_task import ShardTask
from mskgrasp.simulation.versions import versions
from tests.collecting import PARTS


def test_a_node_of_other_software_or_without_the_folder_is_refused(collected, monkeypatch):
    monkeypatch.setattr(cluster_node, "_simulator", None)
    config = read_config(CollectConfig, collected / "config.yaml")
    settings = cluster_node.RunSettings(config=config, digest="other", versions=versions())
    task = ShardTask(part=PARTS[1], folder="", index=0, first=0, n=1, seed=5)
    part = cluster_node.PackedPart(name=PARTS[1], content_hash="0", files={})
    reply = cluster_node.make_shard(part, settings, task)
    assert "does not see the dataset" in reply.error and str(collected) in reply.error
    old = replace(settings, versions=dict(settings.versions, sapien="1.0"))
    assert "the node has sapien" in cluster_node.make_shard(part, old, task).error
    assert reply.outcomes == ()


@pytest.fixture
def settings(collected: Path, tmp_path: Path, monkeypatch) -> Iterator[cluster_node.RunSettings]:
    """Of a run into a new folder, on a node that has made nothing and keeps its parts apart."""
    monkeypatch.setattr(cluster_node, "_simulator", None)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")  # a node limits its process to one core
    n_threads = torch.get_num_threads()
    out = tmp_path / "data"
    (out / "shards").mkdir(parents=True)
    shutil.copy(collected / "config.yaml", out)
    config = read_config(CollectConfig, out / "config.yaml").model_copy(update=dict(out=out))
    digest = cluster_node.settings_digest(out)
    yield cluster_node.RunSettings(config=config, digest=digest, versions=versions())
    torch.set_num_threads(n_threads)


def packed() -> cluster_node.PackedPart:
    part = find_part(PARTS[1])
    return cluster_node.PackedPart(name=part.name, content_hash=part.content_hash, files=pack_part(part))


TASK = ShardTask(part=PARTS[1], folder="on the collector's machine", index=0, first=0, n=3, seed=5)


def test_a_node_makes_the_bytes_of_the_collectors_own_machine(collected: Path, request):
    part = packed()  # before the node has a cache of its own
    settings = request.getfixturevalue("settings")
    reply = cluster_node.make_shard(part, settings, TASK)
    assert reply.error == "" and reply.worker == f"{socket.gethostname()}:{os.getpid()}"
    (path,) = list_shards(settings.config.out)
    assert path.read_bytes() == (collected / "shards" / path.name).read_bytes()
    assert [one for one in reply.outcomes if one >= 0] == read_shard(path)[0].success.astype(int).tolist()


def test_what_a_user_can_repair_is_one_line_and_a_defect_has_its_trace(settings, monkeypatch):
    lost = cluster_node.PackedPart(name="nut", content_hash="0" * 64, files={})
    reply = cluster_node.make_shard(lost, settings, TASK)
    assert "is not a part" in reply.error and "\n" not in reply.error and reply.trace == ""

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(cluster_node, "receive_part", full)
    reply = cluster_node.make_shard(lost, settings, TASK)
    assert reply.error == "No space left on device; free some space, what is finished is kept"
    assert reply.trace == ""
    monkeypatch.setattr(cluster_node, "receive_part", lambda *_: 1 // 0)
    reply = cluster_node.make_shard(lost, settings, TASK)
    assert reply.error.startswith("a worker failed: ZeroDivisionError") and "Traceback" in reply.trace
    assert reply.outcomes == ()


def test_the_digest_tells_settings_apart_and_a_folder_without_any(tmp_path: Path):
    assert cluster_node.settings_digest(tmp_path) == ""
    found = set()
    for text in ("seed: 1", "seed: 2", "seed: 1"):
        (tmp_path / "config.yaml").write_text(text)
        found.add(cluster_node.settings_digest(tmp_path))
    assert len(found) == 2
