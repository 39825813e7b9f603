"""Executor of jobs in spawned processes of this machine."""

from __future__ import annotations

import multiprocessing
import signal
import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from mskgrasp.core.errors import MskgraspError
from mskgrasp.runtime.cli import explain_os_error
from mskgrasp.runtime.executor import Completed, Delivered, Died, WorkerContext, WorkerFailed
from mskgrasp.runtime.worker_process import (
    ignore_ctrl_c,
    leave_with_parent,
    one_thread_a_process,
    out_of_reach_of_ctrl_c,
    use_one_core,
)

_LEAVE_S = 5.0
"""Time for an idle process to end by itself, s."""


@dataclass
class _Worker:
    process: Any
    connection: Connection
    number: int | None = None
    """Number of its job; None while it is idle."""


class LocalExecutor:
    """At most `n_workers` processes, started when there is a job for them and kept for the next one.

    Args:
        context: See `worker_pool.Work`, as for the others.
        settings: Argument of `context`.
        n_workers: Greatest number of processes.
        lost_by: Errors with which a process counts as dead.
    """

    def __init__(
        self,
        context: WorkerContext[Any, Any, Any],
        settings: Any,
        n_workers: int,
        *,
        lost_by: tuple[type[Exception], ...] = (),
    ):
        self._arguments = context, settings, lost_by
        self._n_workers = n_workers
        # Spawned: a forked simulator would share the parent's driver state.
        self._spawn: Any = multiprocessing.get_context("spawn")
        self._workers: list[_Worker] = []

    def n_slots(self) -> int:
        """Greatest number of processes."""
        return self._n_workers

    def submit(self, number: int, job: Any) -> None:
        """Send a job to an idle process, or to a new one."""
        idle = next((worker for worker in self._workers if worker.number is None), None)
        worker = idle or self._start()
        worker.number = number
        try:
            worker.connection.send(job)
        except OSError:
            pass  # it has just died; reading from it reports that

    def events(self) -> Iterator[Delivered | Completed | Died]:
        """Wait up to a second for a message of any process.

        Raises:
            WorkerFailed: A process reports an error.
        """
        ready = wait([worker.connection for worker in self._workers], timeout=1.0)
        for worker in [one for one in self._workers if one.connection in ready]:
            number, pid = worker.number, str(worker.process.pid)
            kind, value = _receive(worker)
            if kind == "error":
                raise WorkerFailed(value)
            if kind == "lost":
                _end([worker])
                self._workers.remove(worker)
            if number is None:
                continue
            if kind == "result":
                yield Delivered(number, value)
            elif kind == "done":
                worker.number = None
                yield Completed(number, pid)
            else:
                yield Died(number, pid, reason=value)

    def close(self) -> None:
        """End all processes."""
        _end(self._workers)
        self._workers.clear()

    def _start(self) -> _Worker:
        with one_thread_a_process(), out_of_reach_of_ctrl_c():
            ours, theirs = self._spawn.Pipe()
            process = self._spawn.Process(target=_serve, args=(theirs, *self._arguments), daemon=True)
            process.start()
            theirs.close()
            worker = _Worker(process=process, connection=ours)
            self._workers.append(worker)
        return worker


def _receive(worker: _Worker) -> tuple[str, Any]:
    try:
        return worker.connection.recv()
    except (EOFError, OSError):
        worker.process.join(timeout=5)
        return "lost", f"exit code {worker.process.exitcode}"


def _end(workers: Sequence[_Worker]) -> None:
    """End processes: those without a job by themselves, so that they put away what they use."""
    for worker in workers:
        if worker.number is None:
            worker.connection.close()
    for worker in workers:
        if worker.number is None:
            worker.process.join(timeout=_LEAVE_S)
        worker.process.terminate()
    for worker in workers:
        worker.process.join(timeout=5)
        if worker.process.is_alive():
            worker.process.kill()
            worker.process.join()
        worker.connection.close()


class _ParentGone(Exception):
    """The other end of the connection is closed."""


def _talk(call: Callable[..., Any], *message: Any) -> Any:
    """Receive from the parent, or send to it: a job's own error of these types says nothing of the parent.

    Raises:
        _ParentGone: It has closed the connection.
    """
    try:
        return call(*message)
    except (EOFError, ConnectionError) as error:  # reset: it has ended without reading the last result
        raise _ParentGone from error


def _serve(
    connection: Connection,
    context: WorkerContext[Any, Any, Any],
    settings: Any,
    lost_by: tuple[type[Exception], ...],
) -> None:
    """Serve in a worker process: receive jobs one by one and send their results."""
    ignore_ctrl_c()
    leave_with_parent()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))  # contexts end what they have started
    try:
        use_one_core()
        with context(settings) as do:
            while True:
                for result in do(_talk(connection.recv)):
                    _talk(connection.send, ("result", result))
                _talk(connection.send, ("done", None))
    except _ParentGone:
        pass
    except lost_by as error:
        connection.send(("lost", str(error)))
    except MskgraspError as error:
        connection.send(("error", str(error)))
    except OSError as error:
        connection.send(("error", explain_os_error(error)))
    except Exception as error:
        traceback.print_exc()  # a defect: its place is wanted, once
        connection.send(("error", f"a process failed: {type(error).__name__}: {error}"))
