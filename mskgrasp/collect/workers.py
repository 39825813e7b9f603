"""Shards made by processes with a simulator each."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from mskgrasp.collect.config import CollectConfig
from mskgrasp.runtime.worker_pool import Lost as ProcessLost
from mskgrasp.runtime.worker_pool import Told, Work, spread
from mskgrasp.simulation.versions import ShardTask


@dataclass(frozen=True, kw_only=True)
class Progress:
    """One attempt is over: 1 success, 0 failure, -1 discarded."""

    outcome: int


@dataclass(frozen=True, kw_only=True)
class Finished:
    """A shard lies on disk; `worker` names the process that made it."""

    task: ShardTask
    worker: str


@dataclass(frozen=True, kw_only=True)
class Lost:
    """A worker died; `undone` attempts of its shard will be made again."""

    task: ShardTask
    undone: int
    undone_successes: int
    reason: str


def make_shards(
    config: CollectConfig, tasks: Sequence[ShardTask], n_workers: int
) -> Generator[Progress | Finished | Lost, None, None]:
    """Makes shards in parallel and tells of every step; closing the iterator stops all workers.

    A shard whose worker dies is made again by another, at most `worker_pool.MAX_TRIES` times.

    Raises:
        WorkerFailed: A shard failed for a reason that trying again will not mend.
    """
    successes: dict[ShardTask, int] = {}
    work = Work(_shard_bench, config, name=_name, remedy="leave the part out with --parts")
    events = spread(work, tasks, n_workers)
    try:
        for event in events:
            if isinstance(event, Told):
                successes[event.job] = successes.get(event.job, 0) + (event.result == 1)
                yield Progress(outcome=event.result)
            elif isinstance(event, ProcessLost):
                yield Lost(
                    task=event.job,
                    undone=event.n_told,
                    undone_successes=successes.pop(event.job, 0),
                    reason=event.reason,
                )
            else:
                yield Finished(task=event.job, worker=event.process)
    finally:
        events.close()


def _name(task: ShardTask) -> str:
    return f"shard {task.index} of part '{task.part}'"


@contextmanager
def _shard_bench(config: CollectConfig) -> Iterator[Callable[[ShardTask], Iterator[int]]]:
    """A simulator, and the function that makes a shard and writes it, telling of every attempt."""
    from mskgrasp.simulation.shard import Simulator

    simulator = Simulator(config.physics, config.camera, config.noise)
    yield lambda task: simulator.write(task, config.out)
