"""Progress bars of all programs."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterable
from typing import Any, TextIO

from tqdm import tqdm

from mskgrasp.core.errors import one_line

Bar = tqdm
"""A progress bar."""
# Not tqdm's own lock, a semaphore among processes: a worker that is ended leaks it, and Python warns of that.
Bar.set_lock(threading.RLock())
_LINE_EVERY_S = 20.0
"""Interval of the lines where standard error is no terminal."""
_TRANSIENT_DELAY_S = 1.0
"""A short stage shows no bar."""


class _Lines:
    """A stream that receives tqdm's redrawn bar as lines of text."""

    def __init__(self, stream: TextIO):
        self._stream = stream
        self.encoding = getattr(stream, "encoding", None)

    def write(self, text: str) -> None:
        if text := text.strip("\r\n "):
            self._stream.write(text + "\n")

    def flush(self) -> None:
        self._stream.flush()


def progress(
    items: Iterable[Any] | None = None,
    *,
    unit: str,
    total: int | None = None,
    done: int = 0,
    title: str | None = None,
    keep: bool = False,
    hidden: bool = False,
) -> Bar:
    """A progress bar on standard error; where that is no terminal, a line every 20 s.

    Args:
        items: Iterated over by the bar; None: the caller calls ``update``.
        unit: Name of the counted unit, singular.
        total: Number of units, those done before included; None: the length of ``items``.
        done: Units that an earlier run finished; the bar starts there.
        title: Text before the bar.
        keep: The bar stays when it is finished, and is shown from the start.
        hidden: Shows nothing, for programs that talk to an operator.

    Returns:
        The bar, a context manager.
    """
    terminal = sys.stderr.isatty()
    shown: dict[str, Any] = (
        dict(file=sys.stderr, dynamic_ncols=True, mininterval=0.2, delay=0.0 if keep else _TRANSIENT_DELAY_S)
        if terminal
        else dict(
            file=_Lines(sys.stderr), ncols=0, mininterval=_LINE_EVERY_S, miniters=1,
            delay=0.0 if keep else _LINE_EVERY_S,
        )
    )  # fmt: skip
    return Bar(
        items, total=total, initial=done, desc=title, unit=unit, leave=keep, disable=hidden, smoothing=0.05,
        **shown,
    )  # fmt: skip


def advance_to(bar: Bar, done: int, total: int) -> None:
    """Move a bar to ``done`` of ``total``, which may only now be known."""
    bar.total = total
    bar.update(done - bar.n)


def note(message: str, stream: TextIO | None = None) -> None:
    """Write a message as one line above any bar, to standard error or the given stream."""
    Bar.write(one_line(message), file=sys.stderr if stream is None else stream)
