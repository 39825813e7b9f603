"""Collecting on a Ray cluster of two nodes on this machine, one of which is lost."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from mskgrasp.collect import cluster
from mskgrasp.core.errors import BadPart, UsageError
from mskgrasp.dataset import list_shards
from mskgrasp.parts import find_part
from mskgrasp.parts.store import pack_part, receive_part
from mskgrasp.runtime.executor import WorkerFailed
from tests.collecting import PARTS, REPOSITORY, assert_equal, command

RAY = [sys.executable, "-m", "ray.scripts.scripts"]


def environment(cache: Path) -> dict[str, str]:
    """Of a node with a cache of its own, which knows no parts; slow machines are given time."""
    return dict(
        os.environ,
        XDG_CACHE_HOME=str(cache),
        PYTHONPATH=os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep),
        RAY_USAGE_STATS_ENABLED="0",
        RAY_raylet_start_wait_time_s="120",
        RAY_agent_register_timeout_ms="100000",
        RAY_worker_niceness="0",
    )


@dataclass(frozen=True)
class Node:
    """A node of the cluster: `ray start --block` and all that it started, in a session of its own."""

    process: subprocess.Popen[bytes]
    folder: Path

    def processes(self) -> list[int]:
        """What belongs to the node, by its place in the process tree and by its folder."""
        return [
            pid for pid, line in command_lines() if str(self.folder).encode() in line or pid in self.family()
        ]

    def family(self) -> set[int]:
        parents = {pid: parent for pid, parent in parent_ids()}
        found = {self.process.pid}
        while more := {pid for pid, parent in parents.items() if parent in found} - found:
            found |= more
        return found

    def workers(self) -> list[int]:
        """Its processes that make shards: Ray names them for what they do."""
        family = self.family()
        return [pid for pid, line in command_lines() if pid in family and line.startswith(b"ray::make_shard")]

    def hold(self) -> bool:
        """Stops a process that makes a shard, so that it does not finish meanwhile; False where none does."""
        for pid in self.workers():
            with suppress_gone():
                os.kill(pid, signal.SIGSTOP)
                if pid in self.workers():
                    return True
                os.kill(pid, signal.SIGCONT)
        return False

    def kill(self) -> None:
        """As when the machine loses its power: no process is asked."""
        doomed = self.processes()
        for pid in doomed:
            with suppress_gone():
                os.kill(pid, signal.SIGKILL)
        self.process.wait(timeout=30)


@contextmanager
def suppress_gone() -> Iterator[None]:
    try:
        yield
    except ProcessLookupError:
        pass


def command_lines() -> Iterator[tuple[int, bytes]]:
    for place in Path("/proc").glob("[0-9]*"):
        try:
            yield int(place.name), (place / "cmdline").read_bytes()
        except OSError:  # it has just ended
            continue


def parent_ids() -> Iterator[tuple[int, int]]:
    for place in Path("/proc").glob("[0-9]*/stat"):
        try:
            yield int(place.parent.name), int(place.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


@dataclass
class TwoNodes:
    """A cluster of two nodes with a core each."""

    address: str
    nodes: list[Node]


def start_node(folder: Path, *options: str) -> Node:
    folder.mkdir()
    log = open(folder / "ray_start.log", "wb")
    process = subprocess.Popen(
        [*RAY, "start", "--block", "--num-cpus=1", "--disable-usage-stats", f"--temp-dir={folder}/ray",
         "--object-store-memory=80000000", *options],
        stdout=log, stderr=subprocess.STDOUT, start_new_session=True, env=environment(folder / "cache"),
        cwd=folder,
    )  # fmt: skip
    log.close()
    node = Node(process, folder)
    deadline = time.monotonic() + 150
    while "Ray runtime started" not in (folder / "ray_start.log").read_text():
        if process.poll() is not None or time.monotonic() > deadline:
            text = (folder / "ray_start.log").read_text()
            node.kill()
            raise RuntimeError(f"ray start failed: {text}")
        time.sleep(0.1)
    return node


@pytest.fixture
def two_nodes() -> Iterator[TwoNodes]:
    # Not under pytest's folders: a Unix socket's path has at most 107 characters.
    with short_folder() as folder:
        address = f"127.0.0.1:{free_port()}"
        port = address.rpartition(":")[2]
        made = TwoNodes(address=address, nodes=[])
        try:
            head = ("--head", f"--port={port}", "--node-ip-address=127.0.0.1", "--include-dashboard=false")
            made.nodes.append(start_node(folder / "a", *head))
            # An address of its own: a driver joins the node that has its own machine's.
            second = (f"--address={address}", "--node-ip-address=127.0.0.2", "--include-log-monitor=false")
            made.nodes.append(start_node(folder / "b", *second))
            yield made
        finally:
            for node in reversed(made.nodes):
                node.kill()


@contextmanager
def short_folder() -> Iterator[Path]:
    import shutil
    import tempfile

    folder = Path(tempfile.mkdtemp(prefix="mg", dir="/tmp"))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@pytest.mark.slow
def test_a_cluster_that_loses_a_node_makes_the_same_bytes_as_one_machine(collected, two_nodes, tmp_path):
    out = tmp_path / "data"
    driver = subprocess.Popen(
        command(out, "--cluster", two_nodes.address), cwd=REPOSITORY, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    head, other = two_nodes.nodes
    deadline = time.monotonic() + 240
    try:
        # The other node is at work on a shard, and something is done.
        while not (list((out / "shards").glob("*.h5")) and other.hold()):
            assert driver.poll() is None, driver.communicate()
            assert time.monotonic() < deadline
            time.sleep(0.02)
        other.kill()
        printed, errors = driver.communicate(timeout=240)
    finally:
        driver.kill()
    assert driver.returncode == 0, errors
    assert "2 cores of the cluster" in printed
    assert "a worker died" in errors and "is made again" in errors
    assert "Traceback" not in errors and "ray" not in re.sub(r"a worker died \(\w+\)", "", errors).lower()
    assert_equal(collected, out)
    # Parts came through the cluster: neither node had any.
    for node in two_nodes.nodes:
        cache = node.folder / "cache" / "mskgrasp"
        # A node that is killed may be unpacking a part.
        names = [path.name for path in (cache / "received").glob("*")]
        received = {
            name.rpartition("-")[0] for name in names if node is not other or not name.startswith(".tmp-")
        }
        assert received <= set(PARTS) and (received or node is other)
        assert not (cache / "parts").exists()

    # What is there stays, and Ctrl-C leaves a cluster that goes on to serve.
    list_shards(out)[0].unlink()
    driver = subprocess.Popen(
        command(out, "--cluster", two_nodes.address), cwd=REPOSITORY, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        while not head.workers():
            assert driver.poll() is None, driver.communicate()
            time.sleep(0.02)
        driver.send_signal(signal.SIGINT)
        _, errors = driver.communicate(timeout=60)
    finally:
        driver.kill()
    assert driver.returncode == 130 and "Traceback" not in errors
    assert errors.strip().splitlines()[-1] == "stopped by Ctrl-C; what was finished is kept"
    deadline = time.monotonic() + 30
    while head.workers():
        assert time.monotonic() < deadline, "a worker goes on after Ctrl-C"
        time.sleep(0.1)


@pytest.mark.parametrize("address", ["", "10.0.0.1", "ray://10.0.0.1:10001", "10.0.0.1:port", "auto:1:2"])
def test_what_is_no_address_is_a_usage_error(address):
    with pytest.raises(UsageError, match="host:port"):
        cluster.check_cluster(address)


@pytest.mark.parametrize("host", ["a..b", "a" * 64])
def test_a_host_that_cannot_be_one_is_one_line(host):
    with pytest.raises(WorkerFailed, match=f"no cluster answers at {host}:6379"):
        cluster._check_reachable(f"{host}:6379")


def test_without_the_extra_the_command_says_what_to_install(tmp_path):
    # An interpreter in which Ray cannot be found, as where it is not installed.
    hide = (
        "import importlib.util as u, runpy, sys; find = u.find_spec; "
        "u.find_spec = lambda name, package=None: None if name == 'ray' else find(name, package); "
        "sys.argv[0] = 'collect'; runpy.run_module('mskgrasp.collect', run_name='__main__')"
    )
    done = subprocess.run(
        [sys.executable, "-c", hide, "--cluster", "auto", "--out", str(tmp_path / "data")],
        capture_output=True, text=True, cwd=REPOSITORY, timeout=120,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.strip() == (
        "mskgrasp.collect: --cluster needs Ray, which is an extra: run EXTRAS=dev,cluster .ci/setup"
    )
    assert not (tmp_path / "data").exists()


def test_a_cluster_that_does_not_answer_is_one_line(tmp_path):
    address = f"127.0.0.1:{free_port()}"
    done = subprocess.run(
        command(tmp_path / "data", "--cluster", address), capture_output=True, text=True, cwd=REPOSITORY,
        timeout=120,
    )  # fmt: skip
    assert done.returncode == 1
    assert f"no cluster answers at {address}" in done.stderr and len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "data").exists()


def test_a_part_keeps_its_hash_on_the_way_and_takes_no_other_parts_place(tmp_path, monkeypatch):
    part = find_part(PARTS[1])
    files = pack_part(part)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    arrived = receive_part(part.name, part.content_hash, files)
    assert arrived.content_hash == part.content_hash
    assert arrived.folder.parent == tmp_path / "mskgrasp" / "received"
    assert not (tmp_path / "mskgrasp" / "parts").exists()
    # Damaged on the node's disk: it is put right. Damaged on the way: it is refused.
    (arrived.folder / "hulls.glb").write_bytes(b"nothing")
    assert receive_part(part.name, part.content_hash, files).folder == arrived.folder
    assert (arrived.folder / "hulls.glb").read_bytes() == files["hulls.glb"]
    spoilt = dict(files, **{"mesh.ply": files["mesh.ply"][:-1] + b"?"})
    with pytest.raises(BadPart, match="arrived damaged"):
        receive_part(part.name, "f" * 64, spoilt)
    for name, contents in (("../x", files), (part.name, {**files, "extra": b""})):
        with pytest.raises(BadPart, match="is not a part"):
            receive_part(name, part.content_hash, contents)
