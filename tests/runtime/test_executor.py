"""Contract of an executor, tested on the one that runs processes of this machine."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from mskgrasp.core.errors import MskgraspError
from mskgrasp.runtime.executor import (
    MAX_NODES,
    MAX_TRIES,
    Completed,
    Delivered,
    Died,
    Executor,
    Loss,
    WorkerFailed,
)
from mskgrasp.runtime.local_executor import LocalExecutor


@contextmanager
def counts(base: int) -> Iterator[Callable[[int], Iterator[int]]]:
    """Job n has n results; job -1 ends its process after one."""

    def work(job: int) -> Iterator[int]:
        yield from (base + k for k in range(abs(job)))
        if job < 0:
            os._exit(7)

    yield work


@pytest.fixture(scope="module")
def events() -> list[Delivered | Completed | Died]:
    """All events of three jobs on two processes, one of which dies."""
    executor: Executor = LocalExecutor(counts, 10, 2)
    jobs = {5: 3, 8: -1, 9: 0}
    waiting, found = list(jobs), []
    try:
        assert executor.n_slots() == 2
        for _ in range(2):
            executor.submit(waiting[0], jobs[waiting.pop(0)])
        running = 2
        while running or waiting:
            for event in executor.events():
                found.append(event)
                running -= not isinstance(event, Delivered)
            while waiting and running < executor.n_slots():
                executor.submit(waiting[0], jobs[waiting.pop(0)])
                running += 1
    finally:
        executor.close()
    return found


def test_results_of_a_job_come_in_order_and_before_its_end(events):
    assert [event for event in events if event.number == 5][:3] == [
        Delivered(5, 10), Delivered(5, 11), Delivered(5, 12),
    ]  # fmt: skip
    for number in (5, 8, 9):
        own = [event for event in events if event.number == number]
        assert all(isinstance(event, Delivered) for event in own[:-1])
        assert isinstance(own[-1], Completed | Died)


def test_a_job_without_results_is_completed_and_a_dead_worker_is_named_with_the_reason(events):
    ends = {event.number: event for event in events if not isinstance(event, Delivered)}
    assert isinstance(ends[5], Completed) and isinstance(ends[9], Completed)
    died = ends[8]
    assert isinstance(died, Died) and died.reason == "exit code 7" and died.loss is Loss.PROCESS
    assert died.worker.isdigit() and died.worker != str(os.getpid())
    assert Delivered(8, 10) in events  # what it had sent is not lost


def test_a_lost_node_may_cost_a_job_more_than_a_dead_process():
    assert MAX_NODES > MAX_TRIES > 1
    assert (
        str(Loss.PROCESS) == f"in {MAX_TRIES} fresh processes" and str(Loss.NODE) == f"on {MAX_NODES} nodes"
    )
    assert issubclass(WorkerFailed, MskgraspError) and WorkerFailed("x").exit_code == 1
