"""Set-up of worker processes: threads, Ctrl-C, and their end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from mskgrasp.runtime.worker_pool import Work, results
from mskgrasp.runtime.worker_process import one_thread_a_process
from tests.runtime.interrupted import STOPPED, interrupted


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


@pytest.mark.parametrize("before", [None, "4"])
def test_processes_have_one_thread_each_and_this_one_its_own_setting_afterwards(
    before: str | None, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    if before is not None:
        monkeypatch.setenv("OMP_NUM_THREADS", before)
    with pytest.raises(RuntimeError), one_thread_a_process():
        assert os.environ["OMP_NUM_THREADS"] == "1"
        raise RuntimeError
    assert os.environ.get("OMP_NUM_THREADS") == before


def test_a_process_ends_with_its_parent():
    """The parent starts a child that would run for a minute, prints its number, and is killed."""
    child = (
        "from mskgrasp.runtime.worker_process import leave_with_parent as l; l(); import time; time.sleep(60)"
    )
    parent = (
        "import subprocess, sys, time\n"
        f"child = subprocess.Popen([sys.executable, '-c', {child!r}])\n"
        "print(child.pid, flush=True)\n"
        "time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", parent], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        pid = int(process.stdout.readline())
        loaded = Path(f"/proc/{pid}/task")
        while len(list(loaded.iterdir())) < 2:  # its watching thread
            assert process.poll() is None
            time.sleep(0.02)
        process.kill()
    deadline = time.monotonic() + 20
    while alive(pid):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def alive(pid: int) -> bool:
    """Whether a process runs; one that has ended may wait for a parent to ask for its exit code."""
    try:
        return "Z (zombie)" not in Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return False
