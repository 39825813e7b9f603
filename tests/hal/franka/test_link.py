"""The connection to a driver's process: why none came about, and what ends one."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from hal.errors import CommunicationLost, DriverMissing, IncompatibleDriver, NotConnected
from hal.franka.driver import DriverName
from tests.hal.franka.robots import arm_at, fci5, robot_for


@pytest.fixture(scope="module", params=["franky", pytest.param("panda_py", marks=pytest.mark.slow)])
def driver(request: pytest.FixtureRequest) -> DriverName:
    return request.param


@pytest.mark.parametrize(("driver", "version"), [("franky", 5), ("panda_py", 6)])
def test_a_robot_of_another_version_is_reported_with_the_remedy(
    driver: DriverName, version: int, tmp_path: Path
):
    with fci5(version=version) as robot:
        with pytest.raises(IncompatibleDriver, match="which driver package fits") as caught:
            arm_at(tmp_path, driver, robot.host).connect()
        assert "\n" not in str(caught.value)


def test_no_robot_at_the_address_is_reported(driver: DriverName, tmp_path: Path):
    with pytest.raises(NotConnected, match="no robot at 127.0.0.250"):
        arm_at(tmp_path, driver, "127.0.0.250").connect()


def test_a_robot_without_a_hand_is_told_from_no_robot(driver: DriverName, tmp_path: Path):
    with robot_for(driver) as robot:
        robot.order("no_hand")
        with pytest.raises(NotConnected, match="answers, its hand does not: .*in Desk") as caught:
            arm_at(tmp_path, driver, robot.host).connect()
        assert "\n" not in str(caught.value) and "no robot" not in str(caught.value)


def test_a_missing_package_is_reported_with_its_extra(driver: DriverName, tmp_path: Path, monkeypatch):
    name = {"franky": "franky", "panda_py": "panda_py"}[driver]
    (tmp_path / f"{name}.py").write_text(f"raise ModuleNotFoundError('No module named {name}')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(DriverMissing, match=r"EXTRAS=dev,franka"):
        arm_at(tmp_path, driver, "127.0.0.250").connect()


def test_a_driver_that_hangs_is_ended_and_reported_even_where_it_reads_no_request(tmp_path: Path):
    with fci5() as robot, arm_at(tmp_path, "panda_py", robot.host) as arm:
        link = arm._link
        assert link is not None
        os.kill(link.pid, signal.SIGSTOP)
        begin = time.monotonic()
        with pytest.raises(CommunicationLost, match="did not answer 'move_joints' within 1.0 s"):
            link.ask("move_joints", timeout_s=1.0, seconds=[0.0] * 100_000)  # more than a pipe holds
        assert time.monotonic() - begin < 30
        with pytest.raises(CommunicationLost, match="ended by SIGKILL"):
            arm.state()
