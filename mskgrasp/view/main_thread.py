"""Work of the program's main thread, which the page's callbacks ask for from their own threads."""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import Empty

from mskgrasp.core.errors import MskgraspError

FRAME_S = 1 / 30
"""Time between two calls of repeated work, s."""

Work = Callable[[], None]


class MainThread:
    """Pieces of work, done one after the other: a simulator is used by one thread, and nothing overlaps.

    Args:
        failed: Called with an error that a user can correct; any other ends the program.
    """

    def __init__(self, failed: Callable[[MskgraspError], None]):
        self._failed = failed
        self._changed = threading.Condition()
        self._waiting: dict[str, Work] = {}
        self._repeated: dict[str, Work] = {}

    def submit(self, name: str, work: Work) -> None:
        """Have work done soon; it takes the place of work of the same name that still waits."""
        with self._changed:
            self._waiting[name] = work
            self._changed.notify()

    def repeat(self, name: str, work: Work | None) -> None:
        """Have work done every `FRAME_S` while nothing else is to do; None ends that."""
        with self._changed:
            if work is None:
                self._repeated.pop(name, None)
            else:
                self._repeated[name] = work
            self._changed.notify()

    def run(self) -> None:
        """Work until Ctrl-C, which raises `KeyboardInterrupt`."""
        while True:
            self.work_once()

    def work_once(self, timeout_s: float | None = None) -> None:
        """Wait for work, at most for a time in seconds, and do one piece, or all repeated work.

        Raises:
            Empty: Nothing was asked for in time.
        """
        with self._changed:
            wait_s = FRAME_S if self._repeated else timeout_s
            found = self._changed.wait_for(lambda: self._waiting, wait_s)
            if found:
                name = next(iter(self._waiting))
                pieces = [self._waiting.pop(name)]
            else:
                pieces = list(self._repeated.values())
        if not pieces and timeout_s is not None:
            raise Empty
        for work in pieces:
            try:
                work()
            except MskgraspError as error:
                self._failed(error)
