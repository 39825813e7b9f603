"""Several trainings at a time, each in a process of its own."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from mskgrasp.core.errors import MskgraspError, one_line
from mskgrasp.learning.stage import Reporter
from mskgrasp.runtime.progress import progress
from mskgrasp.runtime.worker_process import ignore_ctrl_c, leave_with_parent

_BUSY = 3
"""Exit status of a training that another program is making."""


class TrainingFailed(MskgraspError):
    """A training in a process of its own ended with an error."""


@dataclass(frozen=True, kw_only=True)
class Job:
    """A training.

    Attributes:
        name: In messages.
        needs: Name of the training that has to be done before; empty: none.
        steps: Number of its steps.
    """

    name: str
    needs: str
    steps: int


def make_at_once(jobs: Sequence[Job], at_once: int, make: Callable[[int, Reporter], bool]) -> list[str]:
    """Make trainings.

    Args:
        jobs: The trainings.
        at_once: How many at a time.
        make: Called in a new process with the number of a job; whether no other program is making it.

    Returns:
        Names of those that another program is making.

    Raises:
        TrainingFailed: One ended with an error, which it has printed.
    """
    # By fork what the parent has read is shared instead of copied. CUDA allows it before its first use there.
    context = multiprocessing.get_context("fork")
    done = context.Array("q", len(jobs), lock=False)  # one process writes each
    waiting, running, busy = list(range(len(jobs))), dict[int, Any](), list[str]()
    total = sum(job.steps for job in jobs)
    try:
        with progress(unit="step", total=total, keep=bool(jobs), hidden=not jobs) as bar:
            while waiting or running:
                unmade = {jobs[k].name for k in (*waiting, *running)}
                for k in list(waiting):
                    if len(running) < at_once and jobs[k].needs not in unmade:
                        waiting.remove(k)
                        running[k] = context.Process(
                            target=_run, args=(jobs[k].name, make, k, _Counted(done, k)), daemon=True
                        )
                        running[k].start()
                multiprocessing.connection.wait([one.sentinel for one in running.values()], timeout=1.0)
                for k in [k for k, one in running.items() if not one.is_alive()]:
                    code = running.pop(k).exitcode
                    done[k] = jobs[k].steps  # an early end, too, is all of it
                    if code == _BUSY:
                        busy.append(jobs[k].name)
                    elif code:
                        raise TrainingFailed(
                            f"the training of {jobs[k].name} failed (exit code {code}): see above"
                        )
                bar.update(sum(done) - bar.n)
    finally:
        for process in running.values():
            process.terminate()
            process.join()
    return busy


def _run(name: str, make: Callable[[int, Reporter], bool], number: int, reporter: Reporter) -> None:
    ignore_ctrl_c()
    leave_with_parent()
    try:
        sys.exit(0 if make(number, reporter) else _BUSY)
    except MskgraspError as error:
        sys.exit(one_line(f"{name}: {error}"))


class _Counted(Reporter):
    """Counts steps in memory that is shared among processes."""

    def __init__(self, done: Any, number: int):
        self._done, self._number = done, number

    def stage(self, name: str, *, epochs: int, batches: int, done: int) -> None:
        self._done[self._number] += done

    def batch(self, loss: float) -> None:
        self._done[self._number] += 1
