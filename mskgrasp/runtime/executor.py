"""Executors: what does jobs for a worker pool, and the events by which it reports on them."""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from mskgrasp.core.errors import MskgraspError

MAX_TRIES = 3
"""How many processes may die of a job."""
MAX_NODES = 10
"""How many nodes of a cluster may be lost with a job, which is hardly the job's fault."""

Settings = TypeVar("Settings")
Job = TypeVar("Job")
Result = TypeVar("Result")
WorkerContext = Callable[[Settings], AbstractContextManager[Callable[[Job], Iterator[Result]]]]
"""Sets up what a worker needs, a cell and a planner, and gives the function that does a job."""


class WorkerFailed(MskgraspError):
    """A job failed for good; all results delivered before are valid."""


class Loss(enum.Enum):
    """What was lost together with a job, and how many of them one job may cost."""

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
    """Workers that do one job each at a time; it neither retries nor names anything."""

    def n_slots(self) -> int:
        """How many jobs it accepts at once; may change with time."""
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
