"""A pool of processes, each with its own simulator, that survives the death of any of them."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections import deque
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from mskgrasp.cli import explain_os_error
from mskgrasp.collect.config import CollectConfig
from mskgrasp.collect.work import ShardTask
from mskgrasp.errors import MskgraspError

MAX_TRIES = 3


class WorkerFailed(MskgraspError):
    """A shard could not be made."""


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


@dataclass
class _Worker:
    process: Any
    connection: Connection
    task: ShardTask | None = None
    done: int = 0
    successes: int = 0


def make_shards(
    config: CollectConfig, tasks: Sequence[ShardTask], n_workers: int
) -> Generator[Progress | Finished | Lost, None, None]:
    """Makes shards in parallel and tells of every step; closing the iterator stops all workers.

    A shard whose worker dies is made again by another, at most `MAX_TRIES` times.

    Raises:
        WorkerFailed: A shard failed for a reason that trying again will not mend.
    """
    context = multiprocessing.get_context("spawn")  # a forked simulator shares the parent's driver state
    waiting = deque(tasks)
    tries: dict[tuple[str, int], int] = {}
    workers: list[_Worker] = []
    try:
        while waiting or any(worker.task for worker in workers):
            while waiting and len(workers) < n_workers:
                workers.append(_start(context, config))
            for worker in workers:
                if worker.task is None and waiting:
                    _give(worker, waiting.popleft())
            ready = wait([worker.connection for worker in workers], timeout=1.0)
            for worker in [w for w in workers if w.connection in ready]:
                event = _listen(worker)
                if isinstance(event, Lost):
                    workers.remove(worker)
                    if worker.task is None:
                        continue
                    key = (event.task.part, event.task.index)
                    tries[key] = tries.get(key, 0) + 1
                    if tries[key] >= MAX_TRIES:
                        raise WorkerFailed(
                            f"shard {event.task.index} of part '{event.task.part}' killed its worker "
                            f"{MAX_TRIES} times ({event.reason}); leave the part out with --parts"
                        )
                    waiting.appendleft(event.task)
                if event is not None:
                    yield event
    finally:
        for worker in workers:
            worker.process.terminate()
        for worker in workers:
            worker.process.join(timeout=5)
            if worker.process.is_alive():
                worker.process.kill()
            worker.connection.close()


def _start(context: Any, config: CollectConfig) -> _Worker:
    ours, theirs = context.Pipe()
    process = context.Process(target=_work, args=(theirs, config), daemon=True)
    process.start()
    theirs.close()
    return _Worker(process=process, connection=ours)


def _give(worker: _Worker, task: ShardTask) -> None:
    worker.task, worker.done, worker.successes = task, 0, 0
    try:
        worker.connection.send(task)
    except OSError:
        pass  # it has just died; reading from it says so


def _listen(worker: _Worker) -> Progress | Finished | Lost | None:
    try:
        kind, value = worker.connection.recv()
    except (EOFError, OSError):
        worker.process.join(timeout=5)
        return Lost(
            task=worker.task or _NO_TASK,
            undone=worker.done,
            undone_successes=worker.successes,
            reason=f"exit code {worker.process.exitcode}",
        )
    if kind == "error":
        raise WorkerFailed(value)
    if kind == "progress":
        worker.done += 1
        worker.successes += value == 1
        return Progress(outcome=value)
    task = worker.task
    assert task is not None
    worker.task, worker.done, worker.successes = None, 0, 0
    return Finished(task=task, worker=str(worker.process.pid))


_NO_TASK = ShardTask(part="", folder="", index=-1, first=0, n=0, seed=0)


def _work(connection: Connection, config: CollectConfig) -> None:
    """A worker's life: receive a task, simulate it, write the shard, say so."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides what Ctrl-C means
    _leave_with_parent()
    try:
        use_one_core()
        from mskgrasp.collect.shard import Simulator
        from mskgrasp.dataset import shard_path, write_shard

        simulator = Simulator(config.physics, config.camera, config.noise)
        while True:
            task: ShardTask = connection.recv()
            attempts, info = simulator.run(task, lambda outcome: connection.send(("progress", outcome)))
            write_shard(shard_path(config.out, task.part, task.index), attempts, info)
            connection.send(("finished", None))
    except (EOFError, BrokenPipeError):
        pass
    except MskgraspError as error:
        connection.send(("error", str(error)))
    except OSError as error:
        connection.send(("error", explain_os_error(error)))
    except Exception as error:
        traceback.print_exc()  # a defect: its place is wanted, once
        connection.send(("error", f"a worker failed: {type(error).__name__}: {error}"))


def use_one_core() -> None:
    """Keeps this process to one core: neither torch nor the software renderer may spread over the others."""
    os.environ.setdefault("LP_NUM_THREADS", "1")
    import torch

    torch.set_num_threads(1)
    logging.getLogger("mani_skill").setLevel(logging.ERROR)


def _leave_with_parent() -> None:
    """Ends this process when its parent is gone, however that ended."""
    # Asked now, the system may already name another: the parent can have died while this process started.
    born_of = multiprocessing.parent_process()
    parent = os.getppid() if born_of is None else born_of.pid

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
