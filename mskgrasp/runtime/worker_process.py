"""Processes that keep to one core each, leave Ctrl-C to the one that started them, and do not outlive it."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker


@contextmanager
def one_thread_a_process() -> Iterator[None]:
    """Processes started meanwhile run numerical libraries in one thread: a process a core serves better."""
    before = os.environ.get("OMP_NUM_THREADS")
    os.environ["OMP_NUM_THREADS"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["OMP_NUM_THREADS"]
        else:
            os.environ["OMP_NUM_THREADS"] = before


@contextmanager
def out_of_reach_of_ctrl_c() -> Iterator[None]:
    """Processes started meanwhile never hear Ctrl-C, this one hears it afterwards: it decides what is to end.

    A terminal sends it to all of them. What a process does about it itself comes too late: until then it
    imports, and would end with a traceback.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    resource_tracker.ensure_running()  # starting it lets signals through again
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    # The mask is this thread's: another, a progress bar's, may be handed it, and Python acts on it here.
    heard: list[int] = []
    handler = signal.getsignal(signal.SIGINT)
    ours = handler is not None and threading.current_thread() is threading.main_thread()
    if ours:
        signal.signal(signal.SIGINT, lambda number, frame: heard.append(number))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if ours:
            signal.signal(signal.SIGINT, handler)
        if heard:
            signal.raise_signal(signal.SIGINT)


def leave_with_parent() -> None:
    """Ends this process when its parent is gone, however that ended."""
    # Asked now, the system may already name another: the parent can have died while this process started.
    born_of = multiprocessing.parent_process()
    parent = os.getppid() if born_of is None else born_of.pid

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def use_one_core() -> None:
    """Keeps this process to one core: neither torch nor the software renderer may spread over the others."""
    os.environ.setdefault("LP_NUM_THREADS", "1")
    os.environ["OMP_NUM_THREADS"] = "1"  # torch reads it when it is loaded
    if "torch" in sys.modules:
        sys.modules["torch"].set_num_threads(1)
    logging.getLogger("mani_skill").setLevel(logging.ERROR)
