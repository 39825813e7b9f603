from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import pytest

from hal.driver_process import DriverProcess, NoAnswer, ProcessEnded
from hal.errors import CommunicationLost
from tests.hal.echo_driver import RELEASED


@pytest.fixture
def process() -> Iterator[DriverProcess]:
    process = DriverProcess(["tests.hal.echo_driver"], {"CommunicationLost": CommunicationLost}, exit_s=1.0)
    yield process
    process.close()
    process.close()


def test_an_answer_carries_its_bytes_and_nothing_that_the_driver_prints(process: DriverProcess):
    for n_bytes in (0, 1, 3_000_000):
        answer = process.ask("echo", timeout_s=60, value=[n_bytes, "ä"], n_bytes=n_bytes)
        assert answer.result == [n_bytes, "ä"]
        assert len(answer.payload[0]) == n_bytes


def test_requests_of_several_threads_get_their_own_answers(process: DriverProcess):
    found: dict[int, int] = {}

    def ask(value: int) -> None:
        found[value] = process.ask("echo", timeout_s=60, value=value, n_bytes=value).result

    threads = [threading.Thread(target=ask, args=(value,)) for value in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == {value: value for value in range(8)}


def test_an_error_of_the_driver_is_raised_typed_and_the_driver_goes_on(process: DriverProcess):
    with pytest.raises(CommunicationLost, match="explained: no such value"):
        process.ask("fail", timeout_s=60)
    assert process.ask("echo", timeout_s=60, value=1, n_bytes=0).result == 1


def test_a_driver_that_hangs_is_killed_in_time(process: DriverProcess):
    process.ask("echo", timeout_s=60, value=0, n_bytes=0)
    begin = time.monotonic()
    with pytest.raises(NoAnswer, match="did not answer 'hang' within 0.2 s"):
        process.ask("hang", timeout_s=0.2)
    assert time.monotonic() - begin < 10
    with pytest.raises(ProcessEnded, match="SIGKILL"):
        process.ask("echo", timeout_s=60, value=0, n_bytes=0)


def test_a_request_that_cannot_be_written_ends_in_time(process: DriverProcess):
    os.kill(process.pid, signal.SIGSTOP)
    with pytest.raises(NoAnswer):
        process.ask("echo", timeout_s=0.5, value=[0.0] * 100_000, n_bytes=0)  # more than a pipe holds


def test_a_crash_is_reported_with_the_last_line_of_the_log(process: DriverProcess):
    process.ask("echo", timeout_s=60, value=0, n_bytes=0)
    with pytest.raises(ProcessEnded, match=r"ended by SIGSEGV"):
        process.ask("crash", timeout_s=60)


def _driver() -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", "tests.hal.echo_driver"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )


def test_a_driver_whose_program_dies_before_the_answer_releases_its_device():
    with _driver() as driver:
        assert driver.stdin is not None and driver.stdout is not None
        driver.stdout.close()
        request = {"id": 1, "op": "echo", "value": 0, "n_bytes": 3_000_000}
        driver.communicate(json.dumps(request).encode() + b"\n")
        assert driver.returncode == RELEASED


def test_a_driver_whose_program_dies_while_it_writes_a_request_releases_its_device():
    with _driver() as driver:
        assert driver.stdin is not None
        driver.communicate(b'{"id": 1, "op": "ec')
        assert driver.returncode == RELEASED


def test_an_answer_that_is_no_json_is_an_error_of_the_driver(process: DriverProcess):
    with pytest.raises(CommunicationLost, match="explained: .*not JSON serializable"):
        process.ask("odd", timeout_s=60)
    assert process.ask("echo", timeout_s=60, value=1, n_bytes=0).result == 1


def test_the_kernel_ends_a_driver_whose_alarm_rings(process: DriverProcess):
    with pytest.raises(ProcessEnded, match="SIGALRM"):
        process.ask("hang", timeout_s=60, alarm_s=1)
