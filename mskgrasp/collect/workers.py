"""Shards made by processes of this machine, each with a simulator."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from mskgrasp.collect.config import CollectConfig
from mskgrasp.dataset.labels import read_labels
from mskgrasp.parts.store import read_record
from mskgrasp.runtime.local_executor import LocalExecutor
from mskgrasp.runtime.worker_pool import REMEDY, JobDone, JobLost, JobResult, run_jobs
from mskgrasp.simulation.shard_task import ShardTask

ShardEvents = Generator[JobResult[ShardTask, int] | JobDone[ShardTask] | JobLost[ShardTask], None, None]
"""Results are attempts: 1 success, 0 failure, -1 discarded. A shard that is lost is made again as a whole."""


def make_shards(config: CollectConfig, tasks: Sequence[ShardTask], n_workers: int) -> ShardEvents:
    """Make shards in parallel and yield every step; closing the iterator stops all workers.

    Raises:
        WorkerFailed: A shard failed for a reason that trying again does not remove.
    """
    executor = LocalExecutor(_shard_maker, config, n_workers)
    return run_jobs(tasks, executor, name=task_name, remedy=f"{REMEDY}; {leave_out(config.out)}")


def leave_out(out: Path) -> str:
    """How a collection goes on without a part: its settings are fixed, but for those in its own file."""
    settings = out / "config.yaml"
    return (
        f"or go on without the part: remove its name from {settings}, then python -m mskgrasp.collect "
        f"--config {shlex.quote(str(settings))} --out {shlex.quote(str(out))}"
    )


def task_name(task: ShardTask) -> str:
    """The shard's name in messages."""
    return f"shard {task.index} of part '{task.part}'"


@contextmanager
def _shard_maker(config: CollectConfig) -> Iterator[Callable[[ShardTask], Iterator[int]]]:
    """A simulator, and the function that makes a shard and writes it, yielding every attempt's outcome."""
    from mskgrasp.simulation.shard import Simulator

    simulator = Simulator(config.physics, config.camera, config.noise, planned_by=config.planned_by)
    known = read_labels(config.labels)

    def make(task: ShardTask) -> Iterator[int]:
        labels = known.get((task.part, task.index))
        if labels is None or labels.info.part_hash != read_record(Path(task.folder))["content_hash"]:
            return simulator.write(task, config.out)
        return simulator.restore(task, labels, config.out)

    yield make
