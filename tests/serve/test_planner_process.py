"""The process that plans: started, used, killed, started again."""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
from dataclasses import replace
from pathlib import Path

import pytest

from mskgrasp.core.errors import MskgraspError
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.grasp_models import WEIGHTS
from mskgrasp.serve.config import ServeConfig
from mskgrasp.serve.planner_process import PlannerProcess, ProcessEnded
from mskgrasp.serve.run import planner_settings
from tests.serve.bodies import ALONG, NPZ, npz

BODY = npz(grasps=[ALONG])


def test_a_process_that_stops_or_dies_is_an_error(process: PlannerProcess):
    status, answer = process.ask("score", NPZ, BODY, 30)
    assert status == 200 and json.loads(answer)["grasps"][0]["quality"] > 0.9
    stopped = process.pid
    assert stopped is not None
    os.kill(stopped, signal.SIGSTOP)
    with pytest.raises(ProcessEnded, match="longer than 0.2 s"):
        process.ask("score", NPZ, BODY, 0.2)
    assert process.pid is None and not Path(f"/proc/{stopped}").exists()
    process.start()
    process.kill()
    with pytest.raises(MskgraspError, match="ended while it started"):
        process.wait_until_ready()


def test_a_model_that_is_damaged_is_reported_when_it_is_loaded(tmp_path: Path):
    shutil.copytree(PRETRAINED, tmp_path / "model")
    (tmp_path / "model" / WEIGHTS).write_bytes(b"no weights")
    process = PlannerProcess(replace(planner_settings(ServeConfig()), models=tmp_path / "model"))
    try:
        process.start()
        with pytest.raises(MskgraspError, match="is damaged"):
            process.wait_until_ready()
    finally:
        process.stop()


@pytest.mark.slow
def test_a_process_that_the_system_refuses_can_be_started_later():
    process = PlannerProcess(planner_settings(ServeConfig()))
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    free = os.dup(0)
    os.close(free)
    try:
        for n_more in range(2, 8):  # the pipe of the requests may be opened, not those of the new process
            resource.setrlimit(resource.RLIMIT_NOFILE, (free + n_more, hard))
            with pytest.raises(OSError, match="Too many open files"):
                process.start()
            assert process.pid is None
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    try:
        process.start()
        process.wait_until_ready()
    finally:
        process.stop()
