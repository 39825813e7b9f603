"""Jobs over processes: every result once, whoever makes it, and a worker that dies or fails is told of."""

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
from mskgrasp.runtime.worker_pool import MAX_TRIES, Done, Lost, Told, Work, WorkerFailed, results, spread


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


def test_what_a_dead_process_has_not_told_is_done_again(tmp_path: Path):
    jobs: list[tuple[int, ...]] = [(1, 2, 3)]
    (job,), again = jobs, (2, 3)
    events = list(spread(Work(counting, tmp_path, rest=lambda job, n: job[n:]), jobs, 1))
    assert events[:2] == [Told(job, 1), Lost(job, 1, again, "exit code 9")]
    assert events[2:4] == [Told(again, 2), Told(again, 3)]
    (last,) = events[4:]
    assert isinstance(last, Done) and last.job == again


def test_a_process_that_died_after_all_was_told_has_done_its_job(tmp_path: Path):
    events = list(spread(Work(counting, tmp_path, rest=lambda job, n: job[n:] or None), [(1,)], 1))
    assert events[0] == Told((1,), 1) and isinstance(events[1], Done) and len(events) == 2


def test_a_job_that_every_process_dies_of_ends_the_run_in_one_line(capfd: pytest.CaptureFixture[str]):
    with pytest.raises(WorkerFailed, match=rf"job -1 could not .*{MAX_TRIES} fresh.*exit code 9.*--workers"):
        list(results(Work(bench, 3, name=lambda job: f"job {job}"), [1, -1], 2))
    assert capfd.readouterr().err.count("job -1 is made again") == MAX_TRIES - 1


def test_a_worker_that_fails_says_why():
    with pytest.raises(WorkerFailed, match="no such thing"):
        list(results(Work(bench, 3), [1, -2], 2))


def test_what_a_fresh_process_may_mend_is_tried_again(capfd: pytest.CaptureFixture[str]):
    with pytest.raises(WorkerFailed, match="the cell does not answer"):
        list(results(Work(bench, 3, lost_by=(TimeoutError,)), [1, -3], 2))
    assert capfd.readouterr().err.count("-3 is made again") == MAX_TRIES - 1


@contextmanager
def signals(_: None) -> Iterator[Callable[[int], Iterator[set[int]]]]:
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    yield lambda job: iter([blocked])


def test_no_worker_hears_ctrl_c_and_a_single_job_is_done_here_or_apart():
    here, apart = (list(results(Work(signals, None), [0], 1, apart=apart)) for apart in (False, True))
    several = list(results(Work(signals, None), [1, 2], 2))
    assert [signal.SIGINT in blocked for blocked in here + apart + several] == [False, True, True, True]
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


@pytest.mark.parametrize("threads", [0, 1])
def test_ctrl_c_while_workers_are_started_is_heard_by_the_program_alone(threads: int):
    """A terminal sends it to all of them; a progress bar's thread may be the one that is handed it."""
    code = f"""
import os, signal, threading, time
from multiprocessing import util
from mskgrasp import processes
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
run(lambda: list(processes.results(processes.Work(bench, 3), [1, 2], 2)))
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

run(main)
"""
    assert interrupted(code) == (130, STOPPED)


def test_ctrl_c_while_a_program_imports_is_not_lost():
    program = subprocess.Popen(
        [sys.executable, "-m", "mskgrasp.plan"], stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    status = Path(f"/proc/{program.pid}/status")
    while not int(status.read_text().partition("SigBlk:")[2].split()[0], 16) & 1 << signal.SIGINT - 1:
        assert program.poll() is None
    program.send_signal(signal.SIGINT)
    assert (program.communicate()[1], program.returncode) == (STOPPED, 130)


STOPPED = "stopped by Ctrl-C; what was finished is kept\n"


def interrupted(code: str) -> tuple[int, str]:
    told = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, start_new_session=True, timeout=50,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # where the tests' own is ignored
    )  # fmt: skip
    return told.returncode, told.stderr


def test_whoever_closes_the_iterator_ends_the_workers():
    with closing(results(Work(bench, 3), list(range(1, 20)), 2)) as found:
        pid = next(value for value in found if value > 3 * 19)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
