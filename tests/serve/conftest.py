"""A server for the tests, and its processes."""

from __future__ import annotations

import re
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from mskgrasp.learning.grasp_models import load_models
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.planner import Planner
from mskgrasp.serve.config import ServeConfig
from mskgrasp.serve.planner_process import PlannerProcess
from mskgrasp.serve.run import planner_settings, simulated_table
from tests.programs import running
from tests.serve.bodies import Client

FEW = 300
"""Candidates of a plan."""
BODY_MB = 1.0


@dataclass(frozen=True)
class Server:
    """A running server: its client, its process and those that plan."""

    client: Client
    pid: int

    @property
    def workers(self) -> list[int]:
        children = Path(f"/proc/{self.pid}/task/{self.pid}/children").read_text().split()
        lines = {int(pid): Path(f"/proc/{pid}/cmdline").read_bytes() for pid in children}
        return [pid for pid, line in lines.items() if b"spawn_main" in line]


@contextmanager
def server(*options: str, token: str | None = None) -> Iterator[Server]:
    """A server with one worker on a free port; ended by Ctrl-C, after which no process is left."""
    few = ("--workers", "1", "--planner.n-candidates", str(FEW), "--max-body-mb", str(BODY_MB))
    with running("mskgrasp.serve", "--port", "0", *few, *options) as process:
        line = process.stdout.readline()  # pyright: ignore[reportOptionalMemberAccess]
        found = re.match(r"http://127\.0\.0\.1:(\d+): 1 workers, model pretrained", line)
        assert found, line + process.stderr.read()  # pyright: ignore[reportOptionalMemberAccess]
        served = Server(Client(int(found[1]), token), process.pid)
        workers = served.workers
        yield served
        process.send_signal(signal.SIGINT)
        _, complaints = process.communicate(timeout=20)
        assert process.returncode == 130 and "stopped by Ctrl-C" in complaints, complaints
        assert "Traceback" not in complaints
        assert not [pid for pid in workers if Path(f"/proc/{pid}").exists()]


@pytest.fixture(scope="session")
def served() -> Iterator[Server]:
    """One server for all tests; they leave it as it was."""
    with server() as running_server:
        yield running_server


@pytest.fixture
def process() -> Iterator[PlannerProcess]:
    """A process that is ready to plan."""
    one = PlannerProcess(planner_settings(ServeConfig()))
    try:
        one.start()
        one.wait_until_ready()
        yield one
    finally:
        one.stop()


@pytest.fixture(scope="session")
def planner() -> Planner:
    """The planner of that server, in this process."""
    table = simulated_table()
    return Planner(
        load_models(),
        PlannerConfig(n_candidates=FEW).for_motion(),
        table_z=table.table_z,
        region=table.region,
        min_height=table.min_height,
        lowest_grasp_z=table.lowest_grasp_z,
    )
