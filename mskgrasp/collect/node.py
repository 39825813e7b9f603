"""Shard made in a process of a cluster's node, and the data sent to the node and back."""

from __future__ import annotations

import hashlib
import os
import socket
import traceback
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from mskgrasp.collect.config import CollectConfig
from mskgrasp.core.errors import MskgraspError
from mskgrasp.parts.store import receive_part
from mskgrasp.runtime.cli import explain_os_error
from mskgrasp.runtime.executor import WorkerFailed
from mskgrasp.runtime.worker_process import use_one_core
from mskgrasp.simulation.shard_task import ShardTask
from mskgrasp.simulation.versions import versions

if TYPE_CHECKING:
    from mskgrasp.simulation.shard import Simulator


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """Settings that all shards of a run share, and versions that a node must have.

    Attributes:
        config: The settings; `out` is absolute.
        digest: SHA-256 of the config.yaml in `out`.
        versions: Software versions of the collector.
    """

    config: CollectConfig
    digest: str
    versions: dict[str, str]


@dataclass(frozen=True, kw_only=True)
class PackedPart:
    """A part to be sent to a node: name, content hash, files."""

    name: str
    content_hash: str
    files: dict[str, bytes]


@dataclass(frozen=True, kw_only=True)
class ShardReply:
    """A node's report on a shard.

    Attributes:
        worker: Host and process.
        outcomes: Outcome of each attempt: 1 success, 0 failure, -1 discarded.
        error: Reason why there is no shard, one line; empty if there is one.
        trace: Traceback of a defect; empty for errors that a user can correct.
    """

    worker: str
    outcomes: tuple[int, ...] = ()
    error: str = ""
    trace: str = ""


_simulator: Simulator | None = None
"""Built with the first shard of a process and kept for all others: Ray reuses processes."""


def settings_digest(out: Path) -> str:
    """SHA-256 of a dataset's settings; empty where there are none."""
    settings = out / "config.yaml"
    return hashlib.sha256(settings.read_bytes()).hexdigest() if settings.is_file() else ""


def make_shard(part: PackedPart, settings: RunSettings, task: ShardTask) -> ShardReply:
    """Make a shard and write it to the shared folder."""
    worker = f"{socket.gethostname()}:{os.getpid()}"
    try:
        simulator = _ready_simulator(settings)
        folder = receive_part(part.name, part.content_hash, part.files).folder
        outcomes = tuple(simulator.write(replace(task, folder=str(folder)), settings.config.out))
        return ShardReply(worker=worker, outcomes=outcomes)
    except MskgraspError as error:
        return ShardReply(worker=worker, error=str(error))
    except OSError as error:
        return ShardReply(worker=worker, error=explain_os_error(error))
    except Exception as error:
        problem = f"a worker failed: {type(error).__name__}: {error}"
        return ShardReply(worker=worker, error=problem, trace=traceback.format_exc())


def _ready_simulator(settings: RunSettings) -> Simulator:
    """This process's simulator, built if the node fits the run.

    Raises:
        WorkerFailed: The node has other software, or another folder under the dataset's path.
    """
    global _simulator
    if _simulator is None:
        config, own = settings.config, versions()
        other = [
            f"{name} {own.get(name)} (not {version})"
            for name, version in settings.versions.items()
            if own.get(name) != version
        ]
        if other:
            raise WorkerFailed(f"the node has {', '.join(other)}; install what the collector's machine has")
        if settings_digest(config.out) != settings.digest:
            raise WorkerFailed(
                f"the node does not see the dataset at {config.out}; mount the shared folder at the same "
                "path on every node"
            )
        use_one_core()
        from mskgrasp.simulation.shard import Simulator

        _simulator = Simulator(config.physics, config.camera, config.noise)
    return _simulator
