"""Jobs over processes: every result once, whoever makes it, and a worker that dies or fails is told of."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager

import pytest

from mskgrasp.errors import UsageError
from mskgrasp.processes import WorkerFailed, spread


@contextmanager
def bench(factor: int) -> Iterator[Callable[[int], Iterator[int]]]:
    def work(job: int) -> Iterator[int]:
        if job == -1:
            os._exit(9)
        if job == -2:
            raise UsageError("no such thing")
        yield factor * job
        yield os.getpid()

    yield work


def test_all_jobs_are_done_once_wherever():
    alone = list(spread(bench, 3, range(1, 5), 1))
    assert alone == [3, os.getpid(), 6, os.getpid(), 9, os.getpid(), 12, os.getpid()]
    several = list(spread(bench, 3, range(1, 5), 2))
    pids = {value for value in several if value > 12}
    assert sorted(value for value in several if value <= 12) == [3, 6, 9, 12]
    assert len(several) == 8 and os.getpid() not in pids


def test_a_worker_that_dies_ends_the_run_in_one_line():
    with pytest.raises(WorkerFailed, match=r"exit code 9.*kept.*--workers"):
        list(spread(bench, 3, [1, -1], 2))


def test_a_worker_that_fails_says_why():
    with pytest.raises(WorkerFailed, match="no such thing"):
        list(spread(bench, 3, [1, -2], 2))


def test_whoever_closes_the_iterator_ends_the_workers():
    with closing(spread(bench, 3, list(range(1, 20)), 2)) as results:
        seen = [next(results), next(results)]
    pid = max(seen)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
