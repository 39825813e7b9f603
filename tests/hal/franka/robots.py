"""Robots to test against: processes that speak the real wire protocol, and their faults."""

from __future__ import annotations

import functools
import itertools
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
import pytest
import yaml

from hal import cell_from_yaml
from hal.franka import FrankaArm, PandaPyArmConfig
from hal.franka.driver import DriverName, DriverSettings
from hal.franka.link import DriverLink
from hal.franka.path import JointPath

HOSTS = (f"127.{os.getpid() >> 8 & 255}.{os.getpid() & 255}.{k}" for k in itertools.count(1))
TIMEOUT_S = 120.0
"""For what takes a second on an idle machine."""
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

    def order(self, line: str) -> str:
        """Makes a fault happen, returns when it has, with the answer."""
        stdin, stdout = self.process.stdin, self.process.stdout
        assert stdin is not None and stdout is not None
        stdin.write(line + "\n")
        stdin.flush()
        return stdout.readline().strip()

    def joints(self) -> np.ndarray:
        """(7,) where the arm truly is, radians."""
        return np.array([float(value) for value in self.order("q").split()])

    def load(self) -> np.ndarray:
        """(13,) mass, centre (3,) and inertia (9,) of the load that it was told last."""
        return np.array([float(value) for value in self.order("load").split()])

    def wait(self, seconds: float) -> None:
        """Returns when the robot has lived through so many seconds: a busy machine takes longer for them."""
        end, deadline = float(self.order("clock")) + seconds, time.monotonic() + TIMEOUT_S
        while float(self.order("clock")) < end:
            assert time.monotonic() < deadline, "the simulated robot stands still"
            time.sleep(0.02)

    def wait_until_moved(self, begin: np.ndarray, radians: float = 0.02) -> None:
        """Returns when a joint is this far from where it began."""
        deadline = time.monotonic() + TIMEOUT_S
        while np.abs(self.joints() - begin).max() < radians:
            assert time.monotonic() < deadline, "the arm never moved"
            time.sleep(0.02)

    def freeze(self) -> None:
        """Answers nothing any more, as with the cable pulled."""
        self.process.send_signal(signal.SIGSTOP)


@contextmanager
def franky_sim(host: str | None = None) -> Iterator[FakeRobot]:
    """An FR3 that franky can drive: franky-sim, in MuJoCo."""
    with _serve("tests.hal.franka.franky_sim_server", host or next(HOSTS), []) as robot:
        yield robot


@contextmanager
def fci5(host: str | None = None, version: int = 5) -> Iterator[FakeRobot]:
    """A Panda that panda_py can drive: our own server."""
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder, "model.so")
        model.write_bytes(robot_model())
        arguments = [str(model), str(version)]
        with _serve("tests.hal.franka.fci5_server", host or next(HOSTS), arguments) as robot:
            yield robot


def robot_for(driver: DriverName, host: str | None = None) -> AbstractContextManager[FakeRobot]:
    """The robot that a driver can drive, at a new address or a given one."""
    return franky_sim(host) if driver == "franky" else fci5(host)


def write_cell(
    folder: Path,
    driver: DriverName,
    host: str,
    camera: dict[str, str] | None = None,
    **arm: object,
) -> Path:
    """A cell's file with that arm, quick, and a camera, by default one that is not there."""
    settings = {
        "driver": driver,
        "host": host,
        "robot": "fr3" if driver == "franky" else "panda",
        "max_speed": 1.0,
        "max_joint_speed": 1.0,
        "acceleration": 3.0,
        "joint_acceleration": 6.0,
        "gripper_speed": 0.1,
        # Parts and touches of the tests are made for these.
        "contact_force": 20.0,
        "contact_torque": 20.0,
        "max_grasp_force": 40.0,
        # A busy machine simulates several times slower than real time, and takes its time to start Python.
        "settle_s": 10.0,
        "patience_s": 100.0,
        "connect_timeout_s": 120.0,
        **arm,
    }
    path = folder / f"{driver}.yaml"
    values = {
        "type": "devices",
        "arm": settings,
        "camera": camera or {"driver": "kinect2", "calibration": "none.yaml"},
        "workspace": {"table_z": 0.0, "min_height": 0.002},
    }
    path.write_text(yaml.safe_dump(values))
    return path


def arm_at(folder: Path, driver: DriverName, host: str, **settings: object) -> FrankaArm:
    """The arm of `write_cell`, not connected."""
    arm = cell_from_yaml(write_cell(folder, driver, host, **settings)).arm
    assert isinstance(arm, FrankaArm)
    return arm


def driver_settings(host: str) -> DriverSettings:
    """What a driver is told when it connects; patient with a busy machine."""
    arm = PandaPyArmConfig(driver="panda_py", host=host)
    return DriverSettings(
        host=host, realtime=False, contact_torque=[20.0] * 7, contact_force=20.0,
        stiffness=list(arm.stiffness), damping=list(arm.damping), settle_s=10.0,
    )  # fmt: skip


@contextmanager
def linked(driver: DriverName, host: str) -> Iterator[DriverLink]:
    """A driver in its process, connected to a robot."""
    link = DriverLink(driver, driver_settings(host), TIMEOUT_S)
    try:
        yield link
    finally:
        link.close()


def plain_path(path: JointPath) -> dict[str, list]:
    """A path as it is sent to a driver."""
    return {key: np.asarray(value).tolist() for key, value in vars(path).items()}


@functools.cache
def robot_model() -> bytes:
    """The shared object with the robot's dynamics, which a client loads from the robot: here without any."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.fail("no C compiler for the stub of the robot's model: apt-get install gcc libc6-dev")
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder, "model.c"), Path(folder, "model.so")
        source.write_text("".join(f"void {name}(void) {{}}\n" for name in _SYMBOLS))
        subprocess.run([compiler, "-shared", "-fPIC", "-o", library, source], check=True)
        return library.read_bytes()


@contextmanager
def _serve(module: str, host: str, arguments: list[str]) -> Iterator[FakeRobot]:
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
            if process.poll():
                print(f"{module} had ended: {_text(log)}")
            process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout):
                assert pipe is not None
                pipe.close()


def _text(log: IO[str]) -> str:
    log.seek(0)
    return log.read()[-2000:]
