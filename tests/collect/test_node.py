"""What a cluster's node reports of a shard."""

from __future__ import annotations

from dataclasses import replace

from mskgrasp.collect import node as cluster_node
from mskgrasp.collect.config import CollectConfig
from mskgrasp.core.config import read_config
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
