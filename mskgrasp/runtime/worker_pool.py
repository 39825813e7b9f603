"""Jobs spread over processes, each with a bench of its own; results come as soon as they are there.

A process that dies takes nothing with it: what it had not told yet is done again by a fresh one.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import sys
import traceback
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, TypeVar

from tqdm import tqdm

from mskgrasp.core.errors import MskgraspError
from mskgrasp.runtime.cli import explain_os_error
from mskgrasp.runtime.worker_process import (
    leave_with_parent,
    one_thread_a_process,
    out_of_reach_of_ctrl_c,
    use_one_core,
)

MAX_TRIES = 3
REMEDY = "run the same command again, with fewer --workers if memory was short"

Settings = TypeVar("Settings")
Job = TypeVar("Job")
Result = TypeVar("Result")
Bench = Callable[[Settings], AbstractContextManager[Callable[[Job], Iterator[Result]]]]
"""Sets up what a process works with, a cell and a planner, and gives the function that does a job."""


class WorkerFailed(MskgraspError):
    """A job could not be done; what was told before is sound."""


@dataclass(frozen=True)
class Told(Generic[Job, Result]):
    """One result of a job that goes on."""

    job: Job
    result: Result


@dataclass(frozen=True)
class Done(Generic[Job]):
    """All of a job is done; `process` names who did it."""

    job: Job
    process: str


@dataclass(frozen=True)
class Lost(Generic[Job]):
    """A process died after `n_told` results of its job; `again` will be done in its place."""

    job: Job
    n_told: int
    again: Job
    reason: str


@dataclass
class _Ticket:
    """A job on its way through the processes."""

    job: Any
    deaths: int = 0


@dataclass
class _Worker:
    process: Any
    connection: Connection
    ticket: _Ticket | None = None
    n_told: int = 0


@dataclass(frozen=True)
class Work(Generic[Settings, Job, Result]):
    """What every process does, and what becomes of a job whose process dies.

    `name` and `rest` are called in the process that spreads the jobs.
    """

    bench: Bench[Settings, Job, Result]
    """A function of a module; in a spawned process it is imported again."""
    settings: Settings
    """What it takes; pickled."""
    name: Callable[[Job], str] = str
    """How a message calls a job."""
    rest: Callable[[Job, int], Job | None] = lambda job, n_told: job
    """What is left of a job of which so many results were told, when its process died; None: nothing."""
    remedy: str = REMEDY
    """What to do about a job that `MAX_TRIES` processes died of."""
    lost_by: tuple[type[Exception], ...] = ()
    """Errors that a fresh process may be free of: with one of them, too, a process counts as dead."""


def spread(
    work: Work[Settings, Job, Result], jobs: Sequence[Job], n_workers: int
) -> Generator[Told[Job, Result] | Done[Job] | Lost[Job], None, None]:
    """Does jobs in several processes and tells of every step; closing the iterator ends all processes.

    Which process does which job is left to chance: a job's results must depend on the job alone.

    Args:
        work: What is done.
        jobs: In the order in which they are begun; pickled, as are their results.
        n_workers: At most so many processes at once.

    Raises:
        WorkerFailed: A job failed for a reason that trying again will not mend.
    """
    context = multiprocessing.get_context("spawn")  # a forked simulator shares the parent's driver state
    waiting = deque(_Ticket(job) for job in jobs)
    workers: list[_Worker] = []
    try:
        while waiting or any(worker.ticket for worker in workers):
            if waiting and len(workers) < min(n_workers, len(jobs)):
                with one_thread_a_process(), out_of_reach_of_ctrl_c():
                    while len(workers) < min(n_workers, len(jobs)):
                        workers.append(_start(context, work))
            for worker in workers:
                if worker.ticket is None and waiting:
                    _give(worker, waiting.popleft())
            ready = wait([worker.connection for worker in workers], timeout=1.0)
            for worker in [one for one in workers if one.connection in ready]:
                kind, value = _hear(worker)
                ticket = worker.ticket
                if kind == "error":
                    raise WorkerFailed(value)
                if kind == "lost":
                    _end([worker])
                    workers.remove(worker)
                if ticket is None:
                    continue
                if kind == "result":
                    worker.n_told += 1
                    yield Told(ticket.job, value)
                elif kind == "done":
                    worker.ticket = None
                    yield Done(ticket.job, str(worker.process.pid))
                elif (left := work.rest(ticket.job, worker.n_told)) is None:
                    yield Done(ticket.job, str(worker.process.pid))
                else:
                    again = _Ticket(left, ticket.deaths + 1)
                    if again.deaths >= MAX_TRIES:
                        raise WorkerFailed(
                            f"{work.name(again.job)} could not be done in {MAX_TRIES} fresh processes "
                            f"({value}); what was finished is kept: {work.remedy}"
                        )
                    waiting.appendleft(again)
                    yield Lost(ticket.job, worker.n_told, again.job, value)
    finally:
        _end(workers)


def results(
    work: Work[Settings, Job, Result], jobs: Sequence[Job], n_workers: int, apart: bool = False
) -> Generator[Result, None, None]:
    """What `spread` is told, and a line on stderr where a process was lost.

    With one worker, or one job, the jobs are done in this process unless they are to be done apart; then
    whatever they raise is raised here.
    """
    if not jobs:
        return
    if not apart and (n_workers == 1 or len(jobs) < 2):
        with work.bench(work.settings) as do:
            for job in jobs:
                yield from do(job)
        return
    with contextlib.closing(spread(work, jobs, n_workers)) as events:
        for event in events:
            if isinstance(event, Told):
                yield event.result
            elif isinstance(event, Lost):
                again = f"{work.name(event.again)} is made again"
                tqdm.write(f"a process was lost ({event.reason}); {again}", file=sys.stderr)


def _start(context: Any, work: Work[Any, Any, Any]) -> _Worker:
    ours, theirs = context.Pipe()
    # Not all of it: name and rest may be lambdas, which cannot be pickled.
    process = context.Process(
        target=_work, args=(theirs, work.bench, work.settings, work.lost_by), daemon=True
    )
    process.start()
    theirs.close()
    return _Worker(process=process, connection=ours)


def _give(worker: _Worker, ticket: _Ticket) -> None:
    worker.ticket, worker.n_told = ticket, 0
    try:
        worker.connection.send(ticket.job)
    except OSError:
        pass  # it has just died; reading from it says so


def _hear(worker: _Worker) -> tuple[str, Any]:
    try:
        return worker.connection.recv()
    except (EOFError, OSError):
        worker.process.join(timeout=5)
        return "lost", f"exit code {worker.process.exitcode}"


def _end(workers: Sequence[_Worker]) -> None:
    for worker in workers:
        worker.process.terminate()
    for worker in workers:
        worker.process.join(timeout=5)
        if worker.process.is_alive():
            worker.process.kill()
            worker.process.join()
        worker.connection.close()


def _work(
    connection: Connection, bench: Bench[Any, Any, Any], settings: Any, lost_by: tuple[type[Exception], ...]
) -> None:
    """A process's life: receive a job, do it, say so."""
    leave_with_parent()
    try:
        use_one_core()
        with bench(settings) as do:
            while True:
                for result in do(connection.recv()):
                    connection.send(("result", result))
                connection.send(("done", None))
    except (EOFError, BrokenPipeError):
        pass
    except lost_by as error:
        connection.send(("lost", str(error)))
    except MskgraspError as error:
        connection.send(("error", str(error)))
    except OSError as error:
        connection.send(("error", explain_os_error(error)))
    except Exception as error:
        traceback.print_exc()  # a defect: its place is wanted, once
        connection.send(("error", f"a process failed: {type(error).__name__}: {error}"))
