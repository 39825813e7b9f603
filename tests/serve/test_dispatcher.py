"""Requests that wait for a process."""

from __future__ import annotations

import asyncio
import gc
import json
import os
import shutil
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.serve.config import ServeConfig
from mskgrasp.serve.dispatcher import Dispatcher
from mskgrasp.serve.planner_process import PlannerProcess
from mskgrasp.serve.rejection import Rejected
from mskgrasp.serve.run import planner_settings
from tests.serve.bodies import ALONG, NPZ, npz

BODY = npz(grasps=[ALONG])


async def ask(dispatcher: Dispatcher) -> tuple[int, object]:
    try:
        status, answer = await dispatcher.ask("score", NPZ, BODY)
        return status, json.loads(answer)
    except Rejected as error:
        return error.status, str(error)


@pytest.mark.slow
def test_what_exceeds_queue_or_time_is_503_and_a_process_that_dies_is_replaced(process: PlannerProcess):
    async def story() -> None:
        dispatcher = Dispatcher([process], waiting=1, timeout_s=60.0)
        dispatcher.open()
        assert process.pid is not None
        os.kill(process.pid, signal.SIGSTOP)  # as long as a request takes
        first, second = (asyncio.create_task(ask(dispatcher)) for _ in range(2))
        await asyncio.sleep(0.05)
        assert dispatcher.status == {"workers": 1, "working": 1, "requests": 2}
        status, message = await ask(dispatcher)
        assert status == 503 and "2 requests" in str(message)
        os.kill(process.pid, signal.SIGCONT)
        found = [await first, await second]
        assert [status for status, _ in found] == [200, 200] and found[0] == found[1]

        os.kill(process.pid, signal.SIGSTOP)
        lost, later = (asyncio.create_task(ask(dispatcher)) for _ in range(2))
        await asyncio.sleep(0.05)
        before = process.pid
        os.kill(before, signal.SIGKILL)
        status, message = await lost
        assert status == 503 and "the worker ended" in message["error"]  # pyright: ignore
        assert await later == found[0] and process.pid != before
        assert dispatcher.status == {"workers": 1, "working": 1, "requests": 0}

        assert process.pid is not None
        os.kill(process.pid, signal.SIGSTOP)
        hasty = Dispatcher([process], waiting=0, timeout_s=0.1)
        hasty.open()
        status, message = await ask(hasty)
        assert status == 503 and "no answer within 0.1 s" in str(message)
        assert hasty.status["requests"] == 0
        await hasty.close()
        await dispatcher.close()

    asyncio.run(story())


@pytest.mark.parametrize("asked", [True, False])
def test_a_process_that_is_killed_while_idle_is_replaced_and_no_image_is_blamed(
    asked: bool, process: PlannerProcess
):
    async def story() -> None:
        dispatcher = Dispatcher([process], waiting=1, timeout_s=60.0)
        dispatcher.open()
        await asyncio.sleep(0)
        before = process.pid
        assert before is not None
        os.kill(before, signal.SIGKILL)
        while process.alive:
            time.sleep(0.01)
        assert dispatcher.status == {"workers": 1, "working": 0, "requests": 0}
        if asked:
            assert (await ask(dispatcher))[0] == 200
        while not dispatcher.status["working"]:
            await asyncio.sleep(0.05)
        assert process.pid != before
        await dispatcher.close()

    asyncio.run(story())


def test_an_error_that_nobody_foresaw_is_a_500_and_the_next_request_is_answered(
    process: PlannerProcess, monkeypatch, capsys
):
    answered = process.ask

    def once(*arguments):
        monkeypatch.setattr(process, "ask", answered)
        raise ZeroDivisionError("of a pipe")

    monkeypatch.setattr(process, "ask", once)

    async def story() -> None:
        dispatcher = Dispatcher([process], waiting=1, timeout_s=60.0)
        dispatcher.open()
        status, message = await ask(dispatcher)
        assert status == 500 and "its log says how" in message["error"]  # pyright: ignore
        assert (await ask(dispatcher))[0] == 200
        assert dispatcher.status == {"workers": 1, "working": 1, "requests": 0}
        await dispatcher.close()

    asyncio.run(story())
    assert "ZeroDivisionError: of a pipe" in capsys.readouterr().err


def test_requests_that_nobody_can_answer_are_not_kept(tmp_path: Path, capsys):
    models = tmp_path / "model"
    shutil.copytree(PRETRAINED, models)
    process = PlannerProcess(replace(planner_settings(ServeConfig()), models=models))

    async def story() -> int:
        dispatcher = Dispatcher([process], waiting=1, timeout_s=0.05)
        dispatcher.open()
        shutil.rmtree(models)
        assert process.pid is not None
        os.kill(process.pid, signal.SIGKILL)
        await ask(dispatcher)  # it ends the process, which cannot be started again
        body = bytes(1000)
        before = sys.getrefcount(body)
        for _ in range(5):
            try:
                await dispatcher.ask("plan", NPZ, body)
            except Rejected as error:
                assert error.status == 503
        gc.collect()
        kept = sys.getrefcount(body) - before
        await dispatcher.close()
        return kept

    process.start()
    try:
        process.wait_until_ready()
        assert asyncio.run(story()) == 0
    finally:
        process.stop()


def test_once_it_is_closed_no_thread_uses_a_process(process: PlannerProcess, monkeypatch):
    over: list[str] = []
    plain = process.ask

    def ask_and_note(*arguments: Any) -> tuple[int, bytes]:
        try:
            return plain(*arguments)
        finally:
            time.sleep(0.2)  # as on a machine with other work
            over.append("asked")

    monkeypatch.setattr(process, "ask", ask_and_note)

    async def story() -> None:
        dispatcher = Dispatcher([process], waiting=1, timeout_s=60.0)
        dispatcher.open()
        assert process.pid is not None
        os.kill(process.pid, signal.SIGSTOP)
        lost = asyncio.create_task(ask(dispatcher))
        await asyncio.sleep(0.05)
        await dispatcher.close()
        assert over == ["asked"]
        lost.cancel()

    asyncio.run(story())
