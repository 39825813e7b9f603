"""Processes that keep to one core each, and do not outlive the one that started them."""

from __future__ import annotations

import logging
import multiprocessing
import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager


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
