"""The process in which the Kinect's driver runs: it ends with its program, which survives it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hal.errors import CommunicationLost
from tests.hal.kinect2.bench import BUSY_S, Bench


def test_a_driver_that_does_not_stop_is_ended(bench: Bench):
    camera = bench.camera()
    camera.connect()
    bench.set(fault="refused")
    started = time.monotonic()
    camera.close()
    camera.close()
    assert time.monotonic() - started < 3 + BUSY_S


def test_a_killed_driver_is_reported_and_the_program_lives(bench: Bench):
    with bench.camera() as camera:
        process = camera._process
        assert process is not None
        os.kill(process.pid, signal.SIGKILL)
        with pytest.raises(CommunicationLost, match="SIGKILL"):
            camera.capture()


def test_a_program_that_dies_leaves_no_driver_behind(bench: Bench):
    code = (
        "import os\nfrom pathlib import Path\nfrom hal.kinect2 import Kinect2Camera, Kinect2Config\n"
        f"config = Kinect2Config(driver='kinect2', calibration=Path({str(bench.calibration)!r}))\n"
        "camera = Kinect2Camera(config)\ncamera.connect()\n"
        "print(camera._process.pid, flush=True)\nos.kill(os.getpid(), 9)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == -signal.SIGKILL, done.stderr
    wait_for_end(int(done.stdout))


def test_a_program_that_dies_while_the_driver_hangs_leaves_none_behind(bench: Bench):
    with bench.camera() as camera:
        process = camera._process
        assert process is not None
        bench.set(fault="hung")
        request = dict(op="capture", capture_timeout_s=0.5, alarm_s=1)
        assert process._process.stdin is not None
        process._process.stdin.write(json.dumps(request).encode() + b"\n")
        process._process.stdin.flush()  # and nobody waits for an answer
        assert process._process.wait(1 + BUSY_S) == -signal.SIGALRM


def wait_for_end(pid: int) -> None:
    deadline = time.monotonic() + BUSY_S
    while time.monotonic() < deadline:
        try:
            status = Path(f"/proc/{pid}/stat").read_text()
        except OSError:
            return
        if status.rpartition(")")[2].split()[0] == "Z":
            return  # ended; a container's first process may never ask how
        time.sleep(0.05)
    pytest.fail("the driver's process is still there")
