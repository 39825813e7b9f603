"""Jobs spread over processes, each with a simulator of its own; results come as they are ready."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

from mskgrasp.cli import explain_os_error
from mskgrasp.cores import one_thread_a_process
from mskgrasp.errors import MskgraspError

Settings = TypeVar("Settings")
Job = TypeVar("Job")
Result = TypeVar("Result")
Bench = Callable[[Settings], AbstractContextManager[Callable[[Job], Iterator[Result]]]]
"""Sets up what a process works with, a cell and a planner, and gives the function that does a job."""


class WorkerFailed(MskgraspError):
    """A process could not do its job."""


@dataclass
class _Worker:
    process: Any
    connection: Connection
    busy: bool = False


def spread(
    bench: Bench[Settings, Job, Result], settings: Settings, jobs: Sequence[Job], n_workers: int
) -> Generator[Result, None, None]:
    """Does jobs in this process, or in several, and gives every result as soon as it is there.

    Which process does which job is left to chance: a job's results must depend on the job alone. Closing the
    iterator, as Ctrl-C does, ends all processes.

    Args:
        bench: A function of a module; in a spawned process it is imported again.
        settings: What it takes; pickled.
        jobs: In the order in which they are begun; pickled, as are their results.
        n_workers: 1: no other process is started.

    Raises:
        WorkerFailed: A process died or failed; in this process, whatever the job raises.
    """
    if n_workers == 1 or len(jobs) < 2:
        with bench(settings) as work:
            for job in jobs:
                yield from work(job)
        return
    context = multiprocessing.get_context("spawn")  # a forked simulator shares the parent's driver state
    waiting = deque(jobs)
    workers: list[_Worker] = []
    try:
        with one_thread_a_process():
            for _ in range(min(n_workers, len(jobs))):
                workers.append(_start(context, bench, settings))
        for worker in workers:
            _give(worker, waiting)
        while any(worker.busy for worker in workers):
            ready = wait([worker.connection for worker in workers if worker.busy])
            for worker in [one for one in workers if one.connection in ready]:
                kind, value = _hear(worker)
                if kind == "result":
                    yield value
                elif kind == "done":
                    _give(worker, waiting)
                else:
                    raise WorkerFailed(value)
    finally:
        for worker in workers:
            worker.process.terminate()
        for worker in workers:
            worker.process.join(timeout=5)
            if worker.process.is_alive():
                worker.process.kill()
            worker.connection.close()


def _start(context: Any, bench: Bench[Any, Any, Any], settings: Any) -> _Worker:
    ours, theirs = context.Pipe()
    process = context.Process(target=_work, args=(theirs, bench, settings), daemon=True)
    process.start()
    theirs.close()
    return _Worker(process=process, connection=ours)


def _give(worker: _Worker, waiting: deque[Any]) -> None:
    worker.busy = bool(waiting)
    if waiting:
        try:
            worker.connection.send(waiting.popleft())
        except OSError:
            pass  # it has just died; reading from it says so


def _hear(worker: _Worker) -> tuple[str, Any]:
    try:
        return worker.connection.recv()
    except (EOFError, OSError):
        worker.process.join(timeout=5)
        return "error", (
            f"a worker died (exit code {worker.process.exitcode}); what was finished is kept, run the same "
            "command again, with fewer --workers if memory was short"
        )


def _work(connection: Connection, bench: Bench[Any, Any, Any], settings: Any) -> None:
    """A worker's life: receive a job, do it, say so."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides what Ctrl-C means
    threading.Thread(target=_leave_with_parent, daemon=True).start()
    try:
        os.environ.setdefault("LP_NUM_THREADS", "1")
        with bench(settings) as work:
            while True:
                for result in work(connection.recv()):
                    connection.send(("result", result))
                connection.send(("done", None))
    except (EOFError, BrokenPipeError):
        pass
    except MskgraspError as error:
        connection.send(("error", str(error)))
    except OSError as error:
        connection.send(("error", explain_os_error(error)))
    except Exception as error:
        traceback.print_exc()  # a defect: its place is wanted, once
        connection.send(("error", f"a worker failed: {type(error).__name__}: {error}"))


def _leave_with_parent() -> None:
    """Ends this process when its parent is gone, however that ended."""
    born_of = multiprocessing.parent_process()
    parent = os.getppid() if born_of is None else born_of.pid
    while os.getppid() == parent:
        time.sleep(0.5)
    os._exit(1)
