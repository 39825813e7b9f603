"""Jobs over processes: every result once, whichever makes it; workers that die or fail are reported."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from mskgrasp.core.errors import UsageError
from mskgrasp.runtime.executor import MAX_NODES, MAX_TRIES, Completed, Delivered, Died, Loss, WorkerFailed
from mskgrasp.runtime.worker_pool import Work, process_count, results, run_jobs
from tests.runtime.interrupted import interrupted


@contextmanager
def bench(factor: int) -> Iterator[Callable[[int], Iterator[int]]]:
    def work(job: int) -> Iterator[int]:
        if job == -1:
            os._exit(9)
        if job == -2:
            raise UsageError("no such thing")
        if job == -3:
            raise TimeoutError("the cell does not answer")
        yield factor * job
        yield os.getpid()

    yield work


def test_one_process_for_each_core_that_this_one_may_use():
    assert process_count(3) == 3
    cores = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(cores)})
        assert process_count() == 1
    finally:
        os.sched_setaffinity(0, cores)
    assert process_count() == len(cores)


def test_all_jobs_are_done_once_wherever():
    alone = list(results(Work(bench, 3), range(1, 5), 1))
    assert alone == [3, os.getpid(), 6, os.getpid(), 9, os.getpid(), 12, os.getpid()]
    several = list(results(Work(bench, 3), range(1, 5), 2))
    pids = {value for value in several if value > 12}
    assert sorted(value for value in several if value <= 12) == [3, 6, 9, 12]
    assert len(several) == 8 and os.getpid() not in pids
    assert list(results(Work(bench, 3), [], 2)) == []


class Losing:
    """An executor whose workers are lost with every job, first two processes, then nodes."""

    def __init__(self, n_processes: int):
        self.losses = [Loss.PROCESS] * n_processes
        self.submitted: list[int] = []
        self.closed = False

    def n_slots(self) -> int:
        return 1

    def submit(self, number: int, job: int) -> None:
        self.submitted.append(number)

    def events(self) -> Iterator[Delivered | Completed | Died]:
        loss = self.losses.pop() if self.losses else Loss.NODE
        yield Died(self.submitted[-1], "somewhere", loss.name, loss)

    def close(self) -> None:
        self.closed = True


@pytest.mark.parametrize(
    ("n_processes", "message"),
    [(MAX_TRIES - 1, f"on {MAX_NODES} nodes"), (MAX_TRIES, f"in {MAX_TRIES} fresh processes")],
)
def test_lost_nodes_and_dead_processes_are_counted_apart(n_processes: int, message: str):
    executor = Losing(n_processes)
    with pytest.raises(WorkerFailed, match=f"job 7 could not be done {message} .*: repair it"):
        list(run_jobs([7], executor, name=lambda job: f"job {job}", remedy="repair it"))
    n_tries = n_processes + MAX_NODES if n_processes < MAX_TRIES else MAX_TRIES
    assert len(executor.submitted) == len(set(executor.submitted)) == n_tries and executor.closed


def test_a_job_that_every_process_dies_of_ends_the_run_in_one_line(capfd: pytest.CaptureFixture[str]):
    with pytest.raises(WorkerFailed, match=rf"job -1 could not .*{MAX_TRIES} fresh.*exit code 9.*--workers"):
        list(results(Work(bench, 3, name=lambda job: f"job {job}"), [1, -1], 2))
    assert capfd.readouterr().err.count("job -1 is made again") == MAX_TRIES - 1


def test_a_worker_that_fails_says_why():
    with pytest.raises(WorkerFailed, match="no such thing"):
        list(results(Work(bench, 3), [1, -2], 2))


def test_an_error_that_a_fresh_process_may_be_free_of_is_tried_again(capfd: pytest.CaptureFixture[str]):
    with pytest.raises(WorkerFailed, match="the cell does not answer"):
        list(results(Work(bench, 3, lost_by=(TimeoutError,)), [1, -3], 2))
    assert capfd.readouterr().err.count("-3 is made again") == MAX_TRIES - 1


@contextmanager
def dying(folder: Path) -> Iterator[Callable[[int], Iterator[int]]]:
    """Dies after its only result, once."""

    def work(job: int) -> Iterator[int]:
        yield job
        if not (folder / "died").exists():
            (folder / "died").touch()
            os._exit(9)

    yield work


def test_an_only_result_that_was_delivered_is_not_delivered_again(tmp_path: Path):
    assert sorted(results(Work(dying, tmp_path), [1, 2, 3], 1, apart=True)) == [1, 2, 3]


def test_importing_the_packages_has_no_side_effect():
    code = """
import os, signal, sys, threading
def state():
    return (signal.getsignal(signal.SIGINT), signal.pthread_sigmask(signal.SIG_BLOCK, ()),
            sys.unraisablehook, threading.active_count(), dict(os.environ))
before = state()
import hal, mskgrasp, mskgrasp.runtime.cli, mskgrasp.runtime.worker_pool
assert state() == before
"""
    assert interrupted(code) == (0, "")
