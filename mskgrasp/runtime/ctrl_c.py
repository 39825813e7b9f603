"""Ctrl-C: deferred while it would do harm, and repeated where Python drops it."""

from __future__ import annotations

import os
import signal
import sys
import threading
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
        threading.Timer(0.01, os.kill, (os.getpid(), signal.SIGINT)).start()
    else:
        report(unraisable)
