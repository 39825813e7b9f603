"""Set-up of worker processes: threads, Ctrl-C, and their end."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from mskgrasp.runtime.worker_pool import Work, results
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
