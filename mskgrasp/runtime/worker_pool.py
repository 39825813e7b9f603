"""Jobs distributed over worker processes by any executor, with retries and one stream of events.

A worker that dies takes nothing with it: the results it has not delivered are computed by a fresh one.
"""

from __future__ import annotations

import contextlib
import os
from collections import Counter, deque
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic

from mskgrasp.runtime.executor import (
    Delivered,
    Died,
    Executor,
    Job,
    Loss,
    Result,
    Settings,
    WorkerContext,
    WorkerFailed,
)
from mskgrasp.runtime.local_executor import LocalExecutor
from mskgrasp.runtime.progress import note

REMEDY = "run the same command again, with fewer --workers if memory was short"


def process_count(asked: int = 0) -> int:
    """The number of processes asked for, or, for 0, one for each core that this process may use."""
    if asked:
        return asked
    # macOS does not bind processes to cores.
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def whole(job: Job, n_results: int) -> Job:
    """The job itself: its results so far are void once its worker dies."""
    return job


def unless_delivered(job: Job, n_results: int) -> Job | None:
    """The job itself while its only result has not been delivered; then nothing."""
    return None if n_results else job


@dataclass(frozen=True)
class JobResult(Generic[Job, Result]):
    """One result of a job, which may have more."""

    job: Job
    result: Result


@dataclass(frozen=True)
class JobDone(Generic[Job]):
    """A job is complete; `worker` names the process that did it."""

    job: Job
    worker: str


@dataclass(frozen=True)
class JobLost(Generic[Job]):
    """A worker died after `n_results` results of its job; `retry` will be done in its place."""

    job: Job
    n_results: int
    retry: Job
    reason: str


@dataclass(frozen=True)
class Work(Generic[Settings, Job, Result]):
    """Set-up of a pool's workers, names of its jobs, and retries of a job whose worker dies."""

    context: WorkerContext[Settings, Job, Result]
    """A function of a module; a spawned process imports it."""
    settings: Settings
    """Argument of `context`; pickled."""
    name: Callable[[Job], str] = str
    """The job's name in messages."""
    rest: Callable[[Job, int], Job | None] = unless_delivered
    """Remainder of a job for a new worker, given the number of delivered results; None: nothing remains.

    A job of several results needs another function than the default.
    """
    remedy: str = REMEDY
    """Remedy in the message about a job that cost too many workers."""
    lost_by: tuple[type[Exception], ...] = ()
    """Errors that a fresh process may be free of: a worker that raises one counts as dead."""


@dataclass
class _Running:
    """A running job, and the processes and nodes that it has cost so far."""

    job: Any
    n_results: int = 0
    losses: Counter[Loss] = field(default_factory=Counter)


def run_jobs(
    jobs: Sequence[Job],
    executor: Executor,
    *,
    name: Callable[[Job], str] = str,
    rest: Callable[[Job, int], Job | None] = whole,
    remedy: str = REMEDY,
) -> Generator[JobResult[Job, Any] | JobDone[Job] | JobLost[Job], None, None]:
    """Run jobs on an executor, and close it at the end; closing the iterator stops all jobs.

    Jobs go to the workers in no fixed order: a job's results must depend on the job alone.

    Args:
        jobs: In the order in which they are started; pickled, as are their results.
        executor: Executor of the jobs.
        name: See `Work`.
        rest: See `Work`.
        remedy: See `Work`.

    Raises:
        WorkerFailed: A job failed for a reason that trying again does not remove, or cost too many workers.
    """
    waiting = deque(_Running(job) for job in jobs)
    running: dict[int, _Running] = {}
    n_started = 0
    try:
        while waiting or running:
            n_slots = executor.n_slots()
            while waiting and len(running) < n_slots:
                running[n_started] = waiting.popleft()
                executor.submit(n_started, running[n_started].job)
                n_started += 1
            for event in executor.events():
                one = running[event.number]
                if isinstance(event, Delivered):
                    one.n_results += 1
                    yield JobResult(one.job, event.result)
                    continue
                del running[event.number]
                died = isinstance(event, Died)
                left = rest(one.job, one.n_results) if died else None
                if not died or left is None:
                    yield JobDone(one.job, event.worker)
                    continue
                losses = one.losses + Counter([event.loss])
                if losses[event.loss] >= event.loss.value:
                    raise WorkerFailed(
                        f"{name(left)} could not be done {event.loss} ({event.reason}); "
                        f"what was finished is kept: {remedy}"
                    )
                waiting.appendleft(_Running(left, losses=losses))
                yield JobLost(one.job, one.n_results, left, event.reason)
    finally:
        executor.close()


def results(
    work: Work[Settings, Job, Result], jobs: Sequence[Job], n_workers: int, apart: bool = False
) -> Generator[Result, None, None]:
    """Results of jobs done by processes of this machine, with a line on stderr where a process was lost.

    With one worker, or one job, the jobs are done in this process, and any error is raised here,
    unless `apart` requests separate processes.
    """
    if not jobs:
        return
    if not apart and (n_workers == 1 or len(jobs) < 2):
        with work.context(work.settings) as do:
            for job in jobs:
                yield from do(job)
        return
    executor = LocalExecutor(work.context, work.settings, n_workers, lost_by=work.lost_by)
    events = run_jobs(jobs, executor, name=work.name, rest=work.rest, remedy=work.remedy)
    with contextlib.closing(events):
        for event in events:
            if isinstance(event, JobResult):
                yield event.result
            elif isinstance(event, JobLost):
                note(f"a process was lost ({event.reason}); {work.name(event.retry)} is made again")
