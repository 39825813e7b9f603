"""Process that plans for the server: one core, one model, one request at a time."""

from __future__ import annotations

import multiprocessing
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path

from hal.cell import Workspace
from mskgrasp.core.errors import MskgraspError
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.runtime.worker_process import (
    ignore_ctrl_c,
    leave_with_parent,
    one_thread_a_process,
    out_of_reach_of_ctrl_c,
    use_one_core,
)

READY = b"ready"
START_S = 180.0
"""Longest time in which a process loads its model, seconds: importing torch takes seconds by itself."""


@dataclass(frozen=True, kw_only=True)
class PlannerSettings:
    """What a process needs to plan.

    Attributes:
        models: Folder of the model.
        config: Settings of the planner.
        workspace: Table that the frames show.
    """

    models: Path
    config: PlannerConfig
    workspace: Workspace


class ProcessEnded(Exception):
    """The process died or exceeded its time while it worked on a request, and has to be started again."""


class PlannerProcess:
    """The process as the server sees it; requests and answers are bytes, nothing is unpickled."""

    def __init__(self, settings: PlannerSettings):
        self._settings = settings
        self._process: SpawnProcess | None = None
        self._connection: Connection | None = None

    @property
    def pid(self) -> int | None:
        """Its number in the operating system; None before it is started."""
        return self._process.pid if self._process is not None else None

    @property
    def alive(self) -> bool:
        """Whether it runs, be it that it still loads the model."""
        process = self._process  # another thread may end it meanwhile
        return process is not None and process.is_alive()

    def start(self) -> None:
        """Start the process, or start it again; it loads the model meanwhile: see `wait_until_ready`.

        Raises:
            OSError: The system has no memory, process or file left for it; it can be tried again.
        """
        self.stop()
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        process = context.Process(target=_work, args=(theirs, self._settings), daemon=True)
        try:
            with one_thread_a_process(), out_of_reach_of_ctrl_c():
                process.start()
        finally:
            theirs.close()
            # None: the system refused it. Otherwise it runs, though Ctrl-C may have come meanwhile.
            if process.pid is not None:
                self._process = process

    def wait_until_ready(self) -> None:
        """Wait until the model is loaded.

        Raises:
            MskgraspError: It cannot be loaded.
        """
        assert self._connection is not None
        try:
            if not self._connection.poll(START_S):
                raise MskgraspError(
                    f"a worker did not start within {START_S:g} s: the machine is busy or short of memory; "
                    "start fewer (--workers), or free it"
                )
            message = self._connection.recv_bytes()
        except (EOFError, OSError) as error:
            raise MskgraspError("a worker ended while it started; its errors are above") from error
        if message != READY:
            raise MskgraspError(message.decode())

    def ask(self, kind: str, content_type: str, body: bytes, timeout_s: float) -> tuple[int, bytes]:
        """Have a request answered.

        Args:
            kind: "plan" or "score".
            content_type: Of the body.
            body: The request.
            timeout_s: Longest time, seconds.

        Returns:
            HTTP status and JSON.

        Raises:
            ProcessEnded: It died, or took longer and was ended; `start` starts it again.
        """
        assert self._connection is not None
        try:
            self._connection.send_bytes(f"{kind} {content_type}".encode())
            self._connection.send_bytes(body)
            if not self._connection.poll(timeout_s):
                self.stop()
                raise ProcessEnded(
                    f"the request took longer than {timeout_s:g} s; send a smaller image, or fewer grasps"
                )
            return int(self._connection.recv_bytes()), self._connection.recv_bytes()
        except (EOFError, OSError) as error:
            self.stop()
            raise ProcessEnded(
                "the worker ended on this request; check the image and send it again"
            ) from error

    def kill(self) -> None:
        """Kill the process, from any thread: an `ask` in another one raises an error."""
        process = self._process
        if process is not None:
            process.kill()

    def stop(self) -> None:
        """End the process; no other thread may use it."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None
        if self._process is not None:
            self._process.kill()  # it holds nothing that has to be kept
            self._process.join()
            self._process = None


def _work(connection: Connection, settings: PlannerSettings) -> None:
    """Answer requests until the server ends."""
    ignore_ctrl_c()
    leave_with_parent()
    use_one_core()
    from mskgrasp.learning.grasp_models import load_models
    from mskgrasp.planning.planner import Planner
    from mskgrasp.serve.answers import respond

    try:
        planner = Planner.of_workspace(load_models(settings.models), settings.config, settings.workspace)
    except MskgraspError as error:
        connection.send_bytes(str(error).encode())
        return
    connection.send_bytes(READY)
    while True:
        try:
            kind, content_type = connection.recv_bytes().decode().split(" ", 1)
            status, answer = respond(planner, kind, content_type, connection.recv_bytes())
            connection.send_bytes(str(status).encode())
            connection.send_bytes(answer)
        except (EOFError, OSError):
            return
