"""Executor of jobs on a Ray cluster, whose nodes may fail, and the shards of a run made on it."""

from __future__ import annotations

import contextlib
import importlib.util
import logging
import os
import re
import socket
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from mskgrasp.collect.config import CollectConfig
from mskgrasp.collect.node import PackedPart, RunSettings, ShardReply, make_shard, settings_digest
from mskgrasp.collect.workers import ShardEvents, leave_out, task_name
from mskgrasp.core.errors import UsageError
from mskgrasp.dataset import shard_path
from mskgrasp.parts import Part
from mskgrasp.parts.store import pack_part
from mskgrasp.runtime.executor import Completed, Delivered, Died, Loss, WorkerFailed
from mskgrasp.runtime.worker_pool import run_jobs
from mskgrasp.simulation.shard_task import ShardTask
from mskgrasp.simulation.versions import versions

VISIBLE_S = 120.0
"""Greatest time until a file written by a node appears here (NFS caches listings for a minute), s."""
_ADDRESS = re.compile(r"auto|[A-Za-z0-9_.-]+:[0-9]{1,5}|\[[0-9A-Fa-f:]+\]:[0-9]{1,5}")


def check_cluster(address: str) -> None:
    """Refuse an address that cannot be one, and a machine without Ray.

    Raises:
        UsageError: The message names the extra to install, or the form of an address.
    """
    if not _ADDRESS.fullmatch(address):
        raise UsageError(
            f"--cluster {address}: give auto, or host:port of the head, for example 10.0.0.1:6379"
        )
    if importlib.util.find_spec("ray") is None:
        raise UsageError("--cluster needs Ray, which is an extra: run EXTRAS=dev,cluster .ci/setup")


@contextlib.contextmanager
def connected(address: str) -> Iterator[None]:
    """This process as a driver of the cluster, which must have a node on this machine.

    Raises:
        WorkerFailed: No cluster answers there, or it runs other software.
    """
    # Read when Ray is imported; a user who wants otherwise sets them.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    # Ray prints over the progress bar what happens to its processes; `Died` events report what matters.
    os.environ.setdefault("RAY_DEDUP_LOGS_SKIP_REGEX", ".")
    if address != "auto":
        _check_reachable(address)
    import ray

    try:
        ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
    except Exception as error:  # Ray has no common base class for these errors
        ray.shutdown()
        reason = " ".join(str(error).split())[:300]
        raise WorkerFailed(
            f"cannot join the cluster at {address} ({reason}); on this machine start one, "
            ".venv/bin/ray start --head --num-cpus=0, or join it, .venv/bin/ray start "
            f"--address={'HOST:PORT' if address == 'auto' else address} --num-cpus=0"
        ) from error
    try:
        yield
    finally:
        ray.shutdown()


def _check_reachable(address: str) -> None:
    # Ray itself would try for a minute and then end the process.
    host, _, port = address.rpartition(":")
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=10).close()
    except (OSError, OverflowError, UnicodeError) as error:
        found = getattr(error, "strerror", None) or error
        reason = "no host has such a name" if isinstance(error, UnicodeError) else found
        raise WorkerFailed(
            f"no cluster answers at {address} ({reason}); start one with: .venv/bin/ray start --head"
        ) from error


def count_cores() -> int:
    """Cores of the cluster, busy or not."""
    import ray

    return int(ray.cluster_resources().get("CPU", 0))


class RayExecutor:
    """Jobs as Ray tasks of the cluster that this process is connected to.

    Args:
        start: Starts a Ray task for a job; the task returns a `ShardReply`.
        n_slots: Greatest number of jobs at once; 0: according to the cluster's cores.
    """

    def __init__(self, start: Callable[[ShardTask], Any], n_slots: int):
        self._start = start
        self._n_slots = n_slots
        self._running: dict[Any, int] = {}

    def n_slots(self) -> int:
        """A few more than there are cores: no core waits for this process, and an autoscaler sees demand."""
        return self._n_slots or 2 * count_cores() + 1

    def submit(self, number: int, job: ShardTask) -> None:
        """Start a task."""
        self._running[self._start(job)] = number

    def events(self) -> Iterator[Delivered | Completed | Died]:
        """Wait a moment for tasks that end.

        Raises:
            WorkerFailed: A node reports an error, or cannot start a task.
        """
        import ray
        from ray import exceptions

        ready, _ = ray.wait(list(self._running), num_returns=len(self._running), timeout=0.3)
        for reference in ready:
            number = self._running.pop(reference)
            try:
                reply: ShardReply = ray.get(reference)
            except (exceptions.WorkerCrashedError, exceptions.OutOfMemoryError) as error:
                yield Died(number, "", type(error).__name__, Loss.PROCESS)
                continue
            except (exceptions.NodeDiedError, exceptions.ObjectLostError) as error:
                yield Died(number, "", type(error).__name__, Loss.NODE)
                continue
            except exceptions.RayError as error:
                # Its text ends with the line that says what happened.
                reason = str(error).strip().splitlines()[-1]
                raise WorkerFailed(
                    f"the cluster cannot make shards ({reason}); install the same mskgrasp on every node"
                ) from error
            if reply.error:
                trace = f"\n{reply.trace}" if reply.trace else ""
                raise WorkerFailed(f"{reply.worker}: {reply.error}{trace}")
            for outcome in reply.outcomes:
                yield Delivered(number, outcome)
            yield Completed(number, reply.worker)

    def close(self) -> None:
        """Cancel all tasks."""
        import ray

        for reference in self._running:
            ray.cancel(reference, force=True)
        self._running.clear()


def make_shards_on_cluster(
    config: CollectConfig, tasks: Sequence[ShardTask], parts: Mapping[str, Part]
) -> ShardEvents:
    """Make shards on the cluster's cores and yield all steps of one when it is complete.

    Args:
        config: The run; this process is `connected`.
        tasks: The shards.
        parts: By name; their files are sent to the nodes.

    Raises:
        WorkerFailed: A shard failed for a reason that trying again does not remove.
    """
    import ray

    config = config.model_copy(update={"out": config.out.absolute()})
    settings = ray.put(RunSettings(config=config, digest=settings_digest(config.out), versions=versions()))
    make = ray.remote(num_cpus=1, max_retries=0)(make_shard)
    packed: dict[str, Any] = {}
    left = Counter(task.part for task in tasks)

    def start(task: ShardTask) -> Any:
        if task.part not in packed:
            part = parts[task.part]
            files = pack_part(part)
            packed[task.part] = ray.put(
                PackedPart(name=part.name, content_hash=part.content_hash, files=files)
            )
        started = make.remote(packed[task.part], settings, task)
        left[task.part] -= 1
        if left[task.part] <= 0:  # Ray keeps it for the tasks that were started
            del packed[task.part]
        return started

    remedy = f"repair the nodes and run the same command again, {leave_out(config.out)}"
    return run_jobs(tasks, RayExecutor(start, config.workers), name=task_name, remedy=remedy)


def wait_until_seen(out: Path, tasks: Sequence[ShardTask]) -> None:
    """Wait until the shards that nodes have written appear on this machine.

    Raises:
        WorkerFailed: They do not, within `VISIBLE_S`.
    """
    deadline = time.monotonic() + VISIBLE_S
    unseen = [shard_path(out, task.part, task.index) for task in tasks]
    while unseen := [path for path in unseen if not path.exists()]:
        if time.monotonic() > deadline:
            raise WorkerFailed(
                f"{unseen[0]} and {len(unseen) - 1} others were written on nodes and are not seen here; "
                "is --out the same shared folder everywhere?"
            )
        os.listdir(out / "shards")  # makes a network file system look again
        time.sleep(0.5)
