"""Interface of executors, which do the jobs of a worker pool and report on them by events."""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from mskgrasp.core.errors import MskgraspError

MAX_TRIES = 3
"""Greatest number of processes that may die with a job."""
MAX_NODES = 10
"""Greatest number of cluster nodes that may be lost with a job, which is rarely the job's fault."""

Settings = TypeVar("Settings")
Job = TypeVar("Job")
Result = TypeVar("Result")
WorkerContext = Callable[[Settings], AbstractContextManager[Callable[[Job], Iterator[Result]]]]
"""Context that sets up a worker, such as its cell and planner, and gives the function that does a job."""


class WorkerFailed(MskgraspError):
    """A job failed for good; all results delivered before are valid."""


class Loss(enum.Enum):
    """Kind of machine or process lost with a job; the value is the greatest number that one job may cost."""

    PROCESS = MAX_TRIES
    NODE = MAX_NODES

    def __str__(self) -> str:
        return f"in {self.value} fresh processes" if self is Loss.PROCESS else f"on {self.value} nodes"


@dataclass(frozen=True)
class Delivered:
    """An executor's event: a result of the job with this number."""

    number: int
    result: Any


@dataclass(frozen=True)
class Completed:
    """An executor's event: `worker` has delivered all results of the job with this number."""

    number: int
    worker: str


@dataclass(frozen=True)
class Died:
    """An executor's event: `worker` is gone, and with it the job of this number."""

    number: int
    worker: str
    reason: str
    loss: Loss = Loss.PROCESS


class Executor(Protocol):
    """Group of workers that do one job each at a time; retries and names are left to the pool."""

    def n_slots(self) -> int:
        """Number of jobs that it accepts at once; may change with time."""
        ...

    def submit(self, number: int, job: Any) -> None:
        """Start a job; `events` refer to it by its number."""
        ...

    def events(self) -> Iterator[Delivered | Completed | Died]:
        """Wait for a moment, and yield what has happened; nothing is submitted meanwhile.

        Raises:
            WorkerFailed: A job failed for a reason that trying again does not remove.
        """
        ...

    def close(self) -> None:
        """End all jobs and the executor's own processes."""
        ...
