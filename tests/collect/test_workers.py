"""Shards made by processes of this machine."""

from __future__ import annotations

from pathlib import Path

import pytest

from mskgrasp.collect.config import CollectConfig
from mskgrasp.collect.workers import make_shards, task_name
from mskgrasp.core.config import read_config
from mskgrasp.dataset import list_shards, read_shard
from mskgrasp.parts import find_part
from mskgrasp.runtime.executor import WorkerFailed
from mskgrasp.runtime.worker_pool import JobDone, JobResult
from mskgrasp.simulation.shard_task import ShardTask
from tests.collecting import PARTS


def test_a_shard_is_named_in_messages_by_its_part_and_number():
    assert (
        task_name(ShardTask(part="nut", folder="", index=3, first=30, n=10, seed=0))
        == "shard 3 of part 'nut'"
    )


@pytest.mark.slow
def test_a_shard_that_cannot_be_made_ends_the_work_in_one_line_and_leaves_those_before(
    collected: Path, tmp_path: Path
):
    config = read_config(CollectConfig, collected / "config.yaml").model_copy(update=dict(out=tmp_path))
    (tmp_path / "shards").mkdir()
    whole = ShardTask(part=PARTS[1], folder=str(find_part(PARTS[1]).folder), index=0, first=0, n=3, seed=5)
    lost = ShardTask(part="gone", folder=str(tmp_path / "gone"), index=0, first=0, n=3, seed=5)
    events = make_shards(config, [whole, lost], 1)
    made = [next(events) for _ in range(4)]
    assert all(isinstance(event, JobResult) and event.job == whole for event in made[:3])
    assert isinstance(made[3], JobDone) and made[3].job == whole
    with pytest.raises(WorkerFailed, match="no part or part folder is called .*gone") as raised:
        next(events)
    assert "\n" not in str(raised.value)
    # The same bytes as of the program, which made both parts.
    (path,) = list_shards(tmp_path)
    assert path.read_bytes() == (collected / "shards" / path.name).read_bytes()
    assert [event.result for event in made[:3]] == read_shard(path)[0].success.astype(int).tolist()
