"""Set-up of worker processes: one core each, no Ctrl-C, an end with their parent."""

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

from mskgrasp.runtime.ctrl_c import ctrl_c_deferred
from mskgrasp.runtime.memory import keep_freed_memory


@contextmanager
def one_thread_a_process() -> Iterator[None]:
    """Limit numerical libraries to one thread in processes started meanwhile: one process a core is best."""
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
    """Keep Ctrl-C from processes started in the block; this process receives it at the end of the block.

    A terminal sends it to all of them, but which work ends is this process's decision. They inherit a
    blocked signal until they ignore it themselves, by `ignore_ctrl_c`: until then they import, and would
    end with a traceback.
    """
    with ctrl_c_deferred():  # another thread, a progress bar's, may receive it: the mask is this thread's
        before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
        resource_tracker.ensure_running()  # starting it unblocks signals
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def ignore_ctrl_c() -> None:
    """Make this worker process, and what it starts, ignore Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def leave_with_parent() -> None:
    """End this process soon after its parent has ended, for whatever reason."""
    # Not getppid() alone: the parent may have died while this process started.
    born_of = multiprocessing.parent_process()
    parent = os.getppid() if born_of is None else born_of.pid

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def use_one_core() -> None:
    """Limit torch and the software renderer to one thread each in this process, which keeps its memory."""
    keep_freed_memory()
    os.environ.setdefault("LP_NUM_THREADS", "1")
    os.environ["OMP_NUM_THREADS"] = "1"  # torch reads it when it is loaded
    if "torch" in sys.modules:
        sys.modules["torch"].set_num_threads(1)
    logging.getLogger("mani_skill").setLevel(logging.ERROR)
