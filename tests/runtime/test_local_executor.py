"""Jobs in spawned processes of this machine."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from mskgrasp.runtime.executor import WorkerFailed
from mskgrasp.runtime.local_executor import LocalExecutor
from mskgrasp.runtime.worker_pool import JobDone, JobLost, JobResult, Work, results, run_jobs
from tests.runtime.test_worker_pool import bench


@contextmanager
def counting(folder: Path) -> Iterator[Callable[[tuple[int, ...]], Iterator[int]]]:
    """Dies after its first result, once."""

    def work(job: tuple[int, ...]) -> Iterator[int]:
        for number in job:
            yield number
            if not (folder / "died").exists():
                (folder / "died").touch()
                os._exit(9)

    yield work


def test_what_a_dead_process_has_not_delivered_is_done_again(tmp_path: Path):
    jobs: list[tuple[int, ...]] = [(1, 2, 3)]
    (job,), again = jobs, (2, 3)
    events = list(run_jobs(jobs, LocalExecutor(counting, tmp_path, 1), rest=lambda job, n: job[n:]))
    assert events[:2] == [JobResult(job, 1), JobLost(job, 1, again, "exit code 9")]
    assert events[2:4] == [JobResult(again, 2), JobResult(again, 3)]
    (last,) = events[4:]
    assert isinstance(last, JobDone) and last.job == again


def test_a_process_that_died_after_its_last_result_has_done_its_job(tmp_path: Path):
    jobs: list[tuple[int, ...]] = [(1,)]
    executor = LocalExecutor(counting, tmp_path, 1)
    events = list(run_jobs(jobs, executor, rest=lambda job, n: job[n:] or None))
    assert events[0] == JobResult((1,), 1) and isinstance(events[1], JobDone) and len(events) == 2


@contextmanager
def tidying(folder: Path) -> Iterator[Callable[[int], Iterator[int]]]:
    """Leaves a file while it works, and takes one second for a job."""
    mine = folder / str(os.getpid())
    mine.touch()
    try:

        def work(job: int) -> Iterator[int]:
            time.sleep(1.0)
            yield job

        yield work
    finally:
        mine.unlink()


def test_workers_put_away_what_they_use(tmp_path: Path):
    executor = LocalExecutor(tidying, tmp_path, 2)
    assert len([one for one in run_jobs([1, 2], executor) if isinstance(one, JobResult)]) == 2
    executor.close()
    assert not list(tmp_path.iterdir())
    with closing(results(Work(tidying, tmp_path), list(range(9)), 2)) as found:
        next(found)
        assert len(list(tmp_path.iterdir())) == 2
    assert not list(tmp_path.iterdir())  # although they were at work


@contextmanager
def breaking(folder: Path) -> Iterator[Callable[[str], Iterator[str]]]:
    """Meets files and pipes of its own that end early."""

    def work(job: str) -> Iterator[str]:
        if job == "file":
            raise EOFError("the file ends early")
        reader, writer = os.pipe()
        os.close(reader)
        os.write(writer, b"x")
        yield job

    yield work


@pytest.mark.parametrize(
    ("job", "cause"), [("file", "EOFError: the file ends early"), ("pipe", "Broken pipe")]
)
def test_a_pipe_or_file_of_the_job_that_ends_is_no_lost_parent(tmp_path: Path, job: str, cause: str):
    executor = LocalExecutor(breaking, tmp_path, 1)
    with closing(executor), pytest.raises(WorkerFailed, match=cause):
        list(run_jobs([job], executor))


@contextmanager
def doubling(_: None) -> Iterator[Callable[[int], Iterator[int]]]:
    """Doubles numbers."""

    def work(job: int) -> Iterator[int]:
        yield 2 * job

    yield work


def test_workers_of_a_killed_program_end_silently():
    program = (
        "import os, signal, time\n"
        "from tests.runtime.test_local_executor import doubling\n"
        "from mskgrasp.runtime.local_executor import LocalExecutor\n"
        "executor = LocalExecutor(doubling, None, 1)\n"
        "executor.submit(0, 1)\n"
        "assert executor._workers[0].connection.poll(60)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], stderr=subprocess.PIPE, text=True, timeout=120)
    assert done.returncode == -signal.SIGKILL and not done.stderr


def test_closing_the_iterator_ends_the_workers():
    with closing(results(Work(bench, 3), list(range(1, 20)), 2)) as found:
        pid = next(value for value in found if value > 3 * 19)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
