"""Trials in several processes, each with a simulated cell of its own."""

from __future__ import annotations

import multiprocessing
import signal
import sys
import traceback
from collections import deque
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from typing import Any

from tqdm import tqdm

from hal.errors import HalError
from mskgrasp.cli import explain_os_error
from mskgrasp.collect.workers import use_one_core
from mskgrasp.cores import leave_with_parent
from mskgrasp.errors import MskgraspError
from mskgrasp.trial import Trial
from mskgrasp.trial_runner import Setup, TrialTask, trial_runner

MAX_TRIES = 3
Scene = tuple[TrialTask, ...]
"""Trials that see the same: one process makes them, and looks at the scene once."""


class TrialsStopped(MskgraspError):
    """A trial could not be made; what is finished is stored."""


@dataclass
class _Worker:
    process: Any
    connection: Connection
    left: deque[TrialTask] = field(default_factory=deque)


def run_trials(setup: Setup, scenes: Sequence[Scene], n_workers: int) -> Generator[Trial, None, None]:
    """Makes the trials of scenes in parallel, each told of once its file lies there; closing it stops all.

    What comes of a trial depends neither on the number of processes nor on which of them makes it. A trial
    whose process dies is made again by another, at most `MAX_TRIES` times.

    Raises:
        TrialsStopped: A trial failed for a reason that trying again will not mend.
    """
    context = multiprocessing.get_context("spawn")  # a forked simulator shares the parent's driver state
    waiting = deque(scenes)
    deaths: dict[str, int] = {}
    workers: list[_Worker] = []
    try:
        while waiting or any(worker.left for worker in workers):
            while waiting and len(workers) < n_workers:
                workers.append(_start(context, setup))
            for worker in workers:
                if not worker.left and waiting:
                    _give(worker, waiting.popleft())
            ready = wait([worker.connection for worker in workers], timeout=1.0)
            for worker in [w for w in workers if w.connection in ready]:
                told = _listen(worker)
                if isinstance(told, Trial):
                    yield told
                    continue
                workers.remove(worker)
                if worker.left:
                    key = worker.left[0].key
                    deaths[key] = deaths.get(key, 0) + 1
                    if deaths[key] >= MAX_TRIES:
                        raise TrialsStopped(
                            f"trial {key} could not be made in {MAX_TRIES} fresh processes ({told}); leave "
                            "its part out with --parts"
                        )
                    tqdm.write(f"a process was lost ({told}); trial {key} is made again", file=sys.stderr)
                    waiting.appendleft(tuple(worker.left))
    finally:
        for worker in workers:
            worker.process.terminate()
        for worker in workers:
            worker.process.join(timeout=5)
            if worker.process.is_alive():
                worker.process.kill()
            worker.connection.close()


def _start(context: Any, setup: Setup) -> _Worker:
    ours, theirs = context.Pipe()
    process = context.Process(target=_work, args=(theirs, setup), daemon=True)
    process.start()
    theirs.close()
    return _Worker(process=process, connection=ours)


def _give(worker: _Worker, scene: Scene) -> None:
    worker.left = deque(scene)
    try:
        worker.connection.send(scene)
    except OSError:
        pass  # it has just died; reading from it says so


def _listen(worker: _Worker) -> Trial | str:
    """The next trial, or why there is none: the process is gone, or its cell was lost."""
    try:
        kind, value = worker.connection.recv()
    except (EOFError, OSError):
        worker.process.join(timeout=5)
        return f"exit code {worker.process.exitcode}"
    if kind == "error":
        raise TrialsStopped(value)
    if kind == "trial":
        worker.left.popleft()
    return value


def _work(connection: Connection, setup: Setup) -> None:
    """A process's life: receive a scene, make its trials, say so."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides what Ctrl-C means
    leave_with_parent()
    try:
        use_one_core()
        with trial_runner(setup) as runner:
            while True:
                for task in connection.recv():
                    for trial in runner.run(task):
                        connection.send(("trial", trial))
    except (EOFError, BrokenPipeError):
        pass
    except HalError as error:
        connection.send(("lost", str(error)))  # a simulated cell is whole again when it is built again
    except MskgraspError as error:
        connection.send(("error", str(error)))
    except OSError as error:
        connection.send(("error", explain_os_error(error)))
    except Exception as error:
        traceback.print_exc()  # a defect: its place is wanted, once
        connection.send(("error", f"a process failed: {type(error).__name__}: {error}"))
