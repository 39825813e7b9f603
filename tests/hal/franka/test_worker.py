"""The process of a driver, spoken to over its pipes."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
from dataclasses import asdict

import pytest

from hal.franka.driver import DriverName, DriverSettings
from tests.hal.franka.robots import HOSTS, TIMEOUT_S


@pytest.fixture(scope="module", params=["franky", pytest.param("panda_py", marks=pytest.mark.slow)])
def driver(request: pytest.FixtureRequest) -> DriverName:
    return request.param


def test_a_driver_whose_program_was_killed_while_it_connected_ends_by_itself(driver: DriverName):
    """It must not take the robot later, when another program has left it."""
    host = next(HOSTS)
    settings = DriverSettings(
        host=host, realtime=False, contact_torque=[20.0] * 7, contact_force=20.0,
        stiffness=[], damping=[], settle_s=1.0,
    )  # fmt: skip
    request = {"id": 1, "op": "connect", "settings": asdict(settings), "alarm_s": 3}
    with socket.create_server((host, 1337)):  # takes the call and says nothing
        worker = subprocess.Popen(
            [sys.executable, "-m", "hal.franka.worker", driver],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
        )
        assert worker.stdin is not None
        worker.stdin.write(json.dumps(request).encode() + b"\n")
        worker.stdin.close()
        assert worker.wait(TIMEOUT_S) in (0, -signal.SIGALRM)
