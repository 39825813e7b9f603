"""Ctrl-C: deferred while it would do harm, and repeated where Python drops it."""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def ctrl_c_deferred() -> Iterator[None]:
    """Defer the effect of Ctrl-C to the end of the block.

    For imports: a library whose import is interrupted may swallow the exception, and continue without what
    it was importing.
    """
    handler = signal.getsignal(signal.SIGINT)
    if handler is None or threading.current_thread() is not threading.main_thread():
        yield  # only Python's main thread may change handlers, and receives the exception
        return
    received: list[int] = []
    signal.signal(signal.SIGINT, lambda number, frame: received.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if received:
            signal.raise_signal(signal.SIGINT)


def repeat_dropped_ctrl_c(unraisable: Any, report: Callable[[Any], None] = sys.unraisablehook) -> None:
    """Hook for exceptions that Python only reports: a Ctrl-C while it cleans up an object is sent again."""
    if unraisable.exc_type is KeyboardInterrupt:
        # Not by threading, which waits until its thread runs: here the signal would be lost again.
        _thread.start_new_thread(_send_ctrl_c, ())
    else:
        report(unraisable)


def _send_ctrl_c() -> None:
    time.sleep(0.05)  # the hook has returned by then
    os.kill(os.getpid(), signal.SIGINT)
