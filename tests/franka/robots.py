"""Robots to test against: processes that speak the real wire protocol, and their faults."""

from __future__ import annotations

import itertools
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import pytest

_HOSTS = (f"127.{os.getpid() >> 8 & 255}.{os.getpid() & 255}.{k}" for k in itertools.count(1))
_SYMBOLS = [
    *(f"{kind}{k}" for kind in ("Ji_J_J", "O_J_J", "O_T_J") for k in range(1, 10)),
    "M_NE",
    "c_NE",
    "g_NE",
]


@dataclass(frozen=True, kw_only=True)
class FakeRobot:
    """A robot in a process.

    Attributes:
        host: Its address.
        process: To kill.
    """

    host: str
    process: subprocess.Popen[str]

    def order(self, line: str) -> None:
        """Makes a fault happen and returns when it has."""
        stdin, stdout = self.process.stdin, self.process.stdout
        assert stdin is not None and stdout is not None
        stdin.write(line + "\n")
        stdin.flush()
        assert stdout.readline().strip() == "done"


@contextmanager
def franky_sim(part_width: float = 0.0) -> Iterator[FakeRobot]:
    """An FR3 that franky can drive: franky-sim, in MuJoCo."""
    with _serve("tests.franka.franky_sim_server", [str(part_width)]) as robot:
        yield robot


@contextmanager
def fci5(version: int = 5) -> Iterator[FakeRobot]:
    """A Panda that panda_py can drive: our own server."""
    with tempfile.TemporaryDirectory() as folder:
        model = build_model(Path(folder))
        with _serve("tests.franka.fci5_server", [str(model), str(version)]) as robot:
            yield robot


def build_model(folder: Path) -> Path:
    """The shared object with the robot's dynamics, which a client loads from the robot: here without any."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.fail("no C compiler for the stub of the robot's model: apt-get install gcc libc6-dev")
    source, library = folder / "model.c", folder / "model.so"
    source.write_text("".join(f"void {name}(void) {{}}\n" for name in _SYMBOLS))
    subprocess.run([compiler, "-shared", "-fPIC", "-o", library, source], check=True)
    return library


@contextmanager
def _serve(module: str, arguments: list[str]) -> Iterator[FakeRobot]:
    host = next(_HOSTS)
    with tempfile.TemporaryFile("w+") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", module, host, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
        try:
            assert process.stdout is not None
            if process.stdout.readline().strip() != "ready":
                process.wait(10)
                pytest.fail(f"{module} did not start: {_text(log)}")
            yield FakeRobot(host=host, process=process)
        finally:
            process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout):
                assert pipe is not None
                pipe.close()


def _text(log: IO[str]) -> str:
    log.seek(0)
    return log.read()[-2000:]
