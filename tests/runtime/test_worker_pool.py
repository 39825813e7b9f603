"""Jobs over processes: every result once, whichever makes it; workers that die or fail are reported."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from mskgrasp.core.errors import UsageError
from mskgrasp.runtime.executor import MAX_NODES, MAX_TRIES, Completed, Delivered, Died, Loss, WorkerFailed
from mskgrasp.runtime.local_executor import LocalExecutor
from mskgrasp.runtime.worker_pool import JobDone, JobLost, JobResult, Work, results, run_jobs


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


def test_all_jobs_are_done_once_wherever():
    alone = list(results(Work(bench, 3), range(1, 5), 1))
    assert alone == [3, os.getpid(), 6, os.getpid(), 9, os.getpid(), 12, os.getpid()]
    several = list(results(Work(bench, 3), range(1, 5), 2))
    pids = {value for value in several if value > 12}
    assert sorted(value for value in several if value <= 12) == [3, 6, 9, 12]
    assert len(several) == 8 and os.getpid() not in pids
    assert list(results(Work(bench, 3), [], 2)) == []


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


@contextmanager
def signals(_: None) -> Iterator[Callable[[int], Iterator[bool]]]:
    yield lambda job: iter([signal.getsignal(signal.SIGINT) is signal.SIG_IGN])


def test_workers_ignore_ctrl_c_and_a_single_job_is_done_here_or_apart():
    before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # where the tests' own is ignored
    try:
        here, apart = (list(results(Work(signals, None), [0], 1, apart=apart)) for apart in (False, True))
        several = list(results(Work(signals, None), [1, 2], 2))
        assert here + apart + several == [False, True, True, True]
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
        assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("threads", [0, 1])
def test_ctrl_c_while_workers_are_started_is_heard_by_the_program_alone(threads: int):
    """A terminal sends it to all of them; a progress bar's thread may be the one that is handed it."""
    code = f"""
import os, signal, threading, time
from multiprocessing import util
from mskgrasp.runtime import worker_pool
from mskgrasp.runtime.cli import run
from tests.runtime.test_worker_pool import bench

def start_and_interrupt(*arguments, start=util.spawnv_passfds):
    process = start(*arguments)
    os.killpg(0, signal.SIGINT)
    time.sleep(0.02)
    return process

util.spawnv_passfds = start_and_interrupt
for _ in range({threads}):
    threading.Thread(target=time.sleep, args=(60,), daemon=True).start()
run("program", lambda: list(worker_pool.results(worker_pool.Work(bench, 3), [1, 2], 2)))
"""
    assert interrupted(code) == (130, STOPPED)


def test_ctrl_c_while_python_cleans_up_is_not_lost():
    code = """
import os, signal, time
from mskgrasp.runtime.cli import run

class Scene:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.1)

def main():
    Scene()
    time.sleep(60)

run("program", main)
"""
    assert interrupted(code) == (130, STOPPED)


@pytest.mark.parametrize(
    ("program", "library"),
    [
        ("mskgrasp.plan", "yaml"),
        ("mskgrasp.plan", "numpy"),
        ("mskgrasp.plan", "torch"),
        ("mskgrasp.validate", "yaml"),
        ("mskgrasp plan", "numpy"),
    ],
)
def test_ctrl_c_while_a_program_imports_is_not_lost(program: str, library: str):
    process = subprocess.Popen(
        [sys.executable, "-m", *program.split()], stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    loaded = Path(f"/proc/{process.pid}/maps")
    while f"/{library}/" not in loaded.read_text():
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    assert (process.communicate()[1], process.returncode) == (STOPPED, 130)


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


STOPPED = "stopped by Ctrl-C; what was finished is kept\n"


def interrupted(code: str) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, start_new_session=True, timeout=50,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # where the tests' own is ignored
    )  # fmt: skip
    return done.returncode, done.stderr


def test_whoever_closes_the_iterator_ends_the_workers():
    with closing(results(Work(bench, 3), list(range(1, 20)), 2)) as found:
        pid = next(value for value in found if value > 3 * 19)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
