"""The shards of a run made on the nodes of a Ray cluster, some of which may die."""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import logging
import os
import re
import socket
import time
import traceback
from collections import Counter, deque
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mskgrasp.collect.config import CollectConfig
from mskgrasp.collect.workers import Finished, Lost, Progress
from mskgrasp.core.errors import MskgraspError, UsageError
from mskgrasp.dataset import shard_path
from mskgrasp.parts import Part
from mskgrasp.parts.store import pack_part, receive_part
from mskgrasp.runtime.cli import explain_os_error
from mskgrasp.runtime.worker_pool import MAX_TRIES, WorkerFailed
from mskgrasp.runtime.worker_process import use_one_core
from mskgrasp.simulation.versions import ShardTask, versions

if TYPE_CHECKING:
    from mskgrasp.simulation.shard import Simulator

NODE_TRIES = 10
"""How often a shard may lose its node, which is hardly its own fault, before the run gives up."""
VISIBLE_S = 120.0
"""How long a file that a node has written may take to be seen here (NFS keeps listings for a minute), s."""
_ADDRESS = re.compile(r"auto|[A-Za-z0-9_.-]+:[0-9]{1,5}|\[[0-9A-Fa-f:]+\]:[0-9]{1,5}")


@dataclass(frozen=True, kw_only=True)
class Job:
    """What all shards of a run share, and what a node must agree with.

    Attributes:
        config: The settings; `out` is absolute.
        settings: Digest of the config.yaml that lies in `out`.
        versions: Software versions of the collector.
    """

    config: CollectConfig
    settings: str
    versions: dict[str, str]


@dataclass(frozen=True, kw_only=True)
class PackedPart:
    """A part on its way to a node: name, content hash, files."""

    name: str
    content_hash: str
    files: dict[str, bytes]


@dataclass(frozen=True, kw_only=True)
class Made:
    """What a node says of a shard.

    Attributes:
        worker: Host and process.
        outcomes: Of each attempt: 1 success, 0 failure, -1 discarded.
        error: Why there is no shard, one line; empty if there is.
        trace: Where a defect happened; empty for errors that a user can mend.
    """

    worker: str
    outcomes: tuple[int, ...] = ()
    error: str = ""
    trace: str = ""


def check_cluster(address: str) -> None:
    """Refuses an address that cannot be one, and a machine without Ray.

    Raises:
        UsageError: Says which extra to install, or what an address looks like.
    """
    if not _ADDRESS.fullmatch(address):
        raise UsageError(
            f"--cluster {address}: give auto, or host:port of the head, for example 10.0.0.1:6379"
        )
    if importlib.util.find_spec("ray") is None:
        raise UsageError("--cluster needs Ray, which is an extra: pip install 'mskgrasp[cluster]'")


@contextlib.contextmanager
def connected(address: str) -> Iterator[None]:
    """This process as a driver of the cluster, which must have a node on this machine.

    Raises:
        WorkerFailed: Nobody answers there, or its software is another.
    """
    # Read when Ray is imported; a user who wants otherwise sets them.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    # Ray prints what befalls its processes over the progress bar; what matters is told as `Lost`.
    os.environ.setdefault("RAY_DEDUP_LOGS_SKIP_REGEX", ".")
    if address != "auto":
        _knock(address)
    import ray

    try:
        ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
    except Exception as error:  # Ray has no base class for what may go wrong here
        ray.shutdown()
        reason = " ".join(str(error).split())[:300]
        raise WorkerFailed(
            f"cannot join the cluster at {address} ({reason}); on this machine run: "
            f"ray start --address={'HOST:PORT' if address == 'auto' else address} --num-cpus=0"
        ) from error
    try:
        yield
    finally:
        ray.shutdown()


def _knock(address: str) -> None:
    # Ray itself tries for a minute and then ends the process.
    host, _, port = address.rpartition(":")
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=10).close()
    except (OSError, OverflowError) as error:
        raise WorkerFailed(
            f"no cluster answers at {address} ({getattr(error, 'strerror', None) or error}); "
            "start one with: ray start --head"
        ) from error


def count_cores() -> int:
    """Cores of the cluster, busy or not."""
    import ray

    return int(ray.cluster_resources().get("CPU", 0))


def make_shards_on_cluster(
    config: CollectConfig, tasks: Sequence[ShardTask], parts: Mapping[str, Part]
) -> Generator[Progress | Finished | Lost, None, None]:
    """Makes shards on the cluster's cores and tells of every one that is finished; `connected` must be.

    A shard whose process or node dies is made again elsewhere: at most `MAX_TRIES` times where its process
    died, and `NODE_TRIES` times where the node did.

    Args:
        config: The run.
        tasks: The shards.
        parts: By name; their files are sent to the nodes.

    Raises:
        WorkerFailed: A shard failed for a reason that trying again will not mend.
    """
    import ray
    from ray import exceptions

    config = config.model_copy(update={"out": config.out.absolute()})
    settings = hashlib.sha256((config.out / "config.yaml").read_bytes()).hexdigest()
    job = ray.put(Job(config=config, settings=settings, versions=versions()))
    make = ray.remote(num_cpus=1, max_retries=0)(_make_shard)
    packed: dict[str, Any] = {}
    left = Counter(task.part for task in tasks)
    tries: Counter[tuple[str, int, bool]] = Counter()
    waiting, running = deque(tasks), {}
    while waiting or running:
        # Some more than there are cores, so that none waits for this loop, and an autoscaler sees a demand.
        room = config.workers or 2 * count_cores() + 1
        while waiting and len(running) < room:
            task = waiting.popleft()
            if task.part not in packed:
                part = parts[task.part]
                files = pack_part(part)
                packed[task.part] = ray.put(
                    PackedPart(name=part.name, content_hash=part.content_hash, files=files)
                )
            running[make.remote(packed[task.part], job, task)] = task
        ready, _ = ray.wait(list(running), num_returns=len(running), timeout=0.3)
        for reference in ready:
            task = running.pop(reference)
            try:
                made: Made = ray.get(reference)
            except (
                exceptions.WorkerCrashedError, exceptions.NodeDiedError, exceptions.OutOfMemoryError,
                exceptions.ObjectLostError,
            ) as error:  # fmt: skip
                yield _lost(task, error, tries)
                waiting.appendleft(task)
                continue
            except exceptions.RayError as error:
                # Its text ends with the line that says what happened.
                reason = str(error).strip().splitlines()[-1]
                raise WorkerFailed(
                    f"the cluster cannot make shards ({reason}); install the same mskgrasp on every node"
                ) from error
            if made.error:
                raise WorkerFailed(f"{made.worker}: {made.error}" + (f"\n{made.trace}" if made.trace else ""))
            left[task.part] -= 1
            if not left[task.part]:
                del packed[task.part]
            for outcome in made.outcomes:
                yield Progress(outcome=outcome)
            yield Finished(task=task, worker=made.worker)


def _lost(task: ShardTask, error: Exception, tries: Counter[tuple[str, int, bool]]) -> Lost:
    from ray.exceptions import OutOfMemoryError, WorkerCrashedError

    own_fault = isinstance(error, WorkerCrashedError | OutOfMemoryError)
    key = (task.part, task.index, own_fault)
    tries[key] += 1
    if tries[key] >= (MAX_TRIES if own_fault else NODE_TRIES):
        raise WorkerFailed(
            f"shard {task.index} of part '{task.part}' lost its {'process' if own_fault else 'node'} "
            f"{tries[key]} times ({type(error).__name__}); leave it out with --parts, or see to the nodes"
        )
    return Lost(task=task, undone=0, undone_successes=0, reason=type(error).__name__)


def wait_until_seen(out: Path, tasks: Sequence[ShardTask]) -> None:
    """Waits until the shards that nodes have written are seen on this machine, too.

    Raises:
        WorkerFailed: They are not, after some time.
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


# ---------------------------------------------------------------------- on a node

_simulator: Simulator | None = None
"""Built with the first shard of a process and kept for all others: Ray uses a process again."""


def _make_shard(part: PackedPart, job: Job, task: ShardTask) -> Made:
    """Runs in a process of a node: one shard, written to the shared folder."""
    worker = f"{socket.gethostname()}:{os.getpid()}"
    try:
        simulator = _ready(job)
        folder = receive_part(part.name, part.content_hash, part.files).folder
        outcomes = tuple(simulator.write(replace(task, folder=str(folder)), job.config.out))
        return Made(worker=worker, outcomes=outcomes)
    except MskgraspError as error:
        return Made(worker=worker, error=str(error))
    except OSError as error:
        return Made(worker=worker, error=explain_os_error(error))
    except Exception as error:
        problem = f"a worker failed: {type(error).__name__}: {error}"
        return Made(worker=worker, error=problem, trace=traceback.format_exc())


def _ready(job: Job) -> Simulator:
    """This process's simulator, built where the node fits the job.

    Raises:
        WorkerFailed: The node has other software, or another folder under the dataset's path.
    """
    global _simulator
    if _simulator is None:
        own = versions()
        other = [
            f"{name} {own.get(name)} (not {v})" for name, v in job.versions.items() if own.get(name) != v
        ]
        if other:
            raise WorkerFailed(f"the node has {', '.join(other)}; install what the collector's machine has")
        settings = job.config.out / "config.yaml"
        if not settings.is_file() or hashlib.sha256(settings.read_bytes()).hexdigest() != job.settings:
            raise WorkerFailed(
                f"the node does not see the dataset at {job.config.out}; mount the shared folder at the same "
                "path on every node"
            )
        use_one_core()
        from mskgrasp.simulation.shard import Simulator

        _simulator = Simulator(job.config.physics, job.config.camera, job.config.noise)
    return _simulator
