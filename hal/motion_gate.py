"""Lock of an arm's motions: one at a time, and none after an error or a stop that was not acknowledged."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from hal.errors import MotionAborted, NeedsRecovery, OutOfWorkspace, Stopped

STOPPED = "stop() was called; call recover() when it is safe"


class MotionGate:
    """Motions of one arm, commanded by any thread.

    Attributes:
        stop: Set from any thread; the motion in progress watches it and ends with `Stopped`, and the next is
            refused.
        fault: Why the last motion ended in an error that was not acknowledged; None without one.
    """

    def __init__(self) -> None:
        self.stop = threading.Event()
        self.fault: str | None = None
        self._busy = threading.Lock()

    @contextmanager
    def motion(self, halt: Callable[[], None]) -> Iterator[None]:
        """Context of a motion, entered when that of another thread is over.

        `OutOfWorkspace` is raised before anything moves, and passes. Any other error calls ``halt`` and is
        kept as a fault.

        Raises:
            NeedsRecovery: An earlier error or stop was not acknowledged.
            Stopped: `stop` was set meanwhile.
        """
        with self._busy:
            self.require_no_fault()
            if self.stop.is_set():
                raise NeedsRecovery("stop() was called; call recover() before the next motion")
            try:
                yield
                if self.stop.is_set():
                    raise Stopped(STOPPED)
            except OutOfWorkspace:
                raise
            except BaseException as error:
                self.fault = str(error) or type(error).__name__
                halt()
                if self.stop.is_set() and isinstance(error, MotionAborted):
                    # stop() caused the end, whichever fault the backend reports.
                    raise Stopped(STOPPED) from error
                raise

    def require_no_fault(self) -> None:
        """Raise NeedsRecovery where an error was not acknowledged."""
        if self.fault is not None:
            raise NeedsRecovery(f"the arm stopped before ({self.fault}); check the arm, then call recover()")

    def recover(self, acknowledge: Callable[[], None]) -> None:
        """Acknowledge an error and a stop by ``acknowledge``, after the motion in progress.

        An error of ``acknowledge`` leaves the gate closed.
        """
        with self._busy:
            # Cleared before, not after: a stop() during the recovery must stay in force.
            self.stop.clear()
            try:
                acknowledge()
            except BaseException as error:
                self.fault = self.fault or str(error) or type(error).__name__
                raise
            self.fault = None
