"""The other end of a driver's process: requests with a deadline, typed errors, and no way to hang."""

from __future__ import annotations

import json
import math
import os
import select
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import Future
from dataclasses import asdict
from typing import Any

from hal.errors import CommunicationLost, HalError, MotionAborted, NotConnected
from hal.franka.driver import DriverName, DriverSettings
from hal.franka.faults import MESSAGES

_EXIT_S = 2.0
"""How long a driver may take to stop the arm and end, s; then its process is killed."""
_ALARM_S = 5
"""A driver that has not connected this much later than it may ends itself, s: see the worker."""


class NoAnswer(CommunicationLost):
    """A request took too long."""


class DriverLink:
    """Starts a driver's process, asks it, and kills it when it does not answer in time.

    Args:
        name: Which driver.
        settings: What it is told.
        connect_timeout_s: How long a robot may take to accept the connection, s.

    Raises:
        DriverMissing: Its package is not installed.
        IncompatibleDriver: The robot speaks another version.
        NotConnected: No robot there, or another program holds it.
    """

    def __init__(self, name: DriverName, settings: DriverSettings, connect_timeout_s: float):
        self._host = settings.host
        self._lock = threading.Lock()
        self._writing = threading.Lock()
        self._waiting: dict[int, Future[dict[str, Any]]] = {}
        self._number = 0
        self._ended = False
        self._log = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "hal.franka.worker", name],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            # Ctrl-C is for the program, which then stops the arm; not for the driver under it.
            start_new_session=True,
        )
        assert self._process.stdin is not None
        os.set_blocking(self._process.stdin.fileno(), False)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        try:
            self.ask(
                "connect",
                timeout_s=connect_timeout_s,
                settings=asdict(settings),
                alarm_s=math.ceil(connect_timeout_s) + _ALARM_S,
            )
        except NoAnswer as error:
            self.close()
            raise NotConnected(
                f"{settings.host} did not answer within {connect_timeout_s:g} s: the address ('host') may be "
                "wrong, the cable out, or another program may hold the robot, which serves one at a time"
            ) from error
        except (CommunicationLost, MotionAborted) as error:
            self.close()
            raise NotConnected(f"{settings.host}: connecting failed: {error}") from error
        except BaseException:
            self.close()
            raise

    @property
    def pid(self) -> int:
        """Of the driver's process."""
        return self._process.pid

    def ask(self, op: str, *, timeout_s: float, **values: Any) -> Any:
        """Sends a request and waits for its answer.

        Raises:
            CommunicationLost: No answer within ``timeout_s``; the driver's process was killed, so that the
                robot stopped.
            HalError: What the driver answered.
        """
        answer: Future[dict[str, Any]] = Future()
        with self._lock:
            if self._ended:
                raise CommunicationLost(self._epitaph())
            self._number += 1
            number = self._number
            self._waiting[number] = answer
        deadline_s = time.monotonic() + timeout_s
        try:
            self._send({"id": number, "op": op, **values}, deadline_s)
            reply = answer.result(max(0.0, deadline_s - time.monotonic()))
        except TimeoutError:
            self._kill()
            raise NoAnswer(
                f"no answer from {self._host} to '{op}' within {timeout_s:.1f} s; its link was closed and "
                "the robot has stopped: open the cell again"
            ) from None
        finally:
            self._waiting.pop(number, None)
        if "error" in reply:
            error: HalError = MESSAGES[reply["error"]](reply["message"])
            if isinstance(error, CommunicationLost):
                self._kill()
            raise error
        return reply["result"]

    def close(self) -> None:
        """Stops the arm and ends the process; safe to call twice."""
        assert self._process.stdin is not None
        # A request that cannot be written waits no longer than it may.
        with self._writing:
            self._process.stdin.close()
        try:
            self._process.wait(_EXIT_S)
        except subprocess.TimeoutExpired:
            self._kill()
        self._process.wait()
        self._reader.join()
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._log.close()

    def _send(self, request: dict[str, Any], deadline_s: float) -> None:
        """Writes a request: a driver that hangs reads none, and a path may be longer than the pipe.

        Raises:
            TimeoutError: It could not be written in time.
            CommunicationLost: The driver's process has ended.
        """
        stdin = self._process.stdin
        assert stdin is not None
        rest = memoryview(json.dumps(request).encode() + b"\n")
        if not self._writing.acquire(timeout=max(0.0, deadline_s - time.monotonic())):
            raise TimeoutError
        try:
            while rest:
                if stdin.closed:
                    raise BrokenPipeError
                _, ready, _ = select.select([], [stdin], [], max(0.0, deadline_s - time.monotonic()))
                if not ready:
                    raise TimeoutError
                rest = rest[os.write(stdin.fileno(), rest) :]
        except BrokenPipeError:
            raise CommunicationLost(self._epitaph()) from None
        finally:
            self._writing.release()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            try:
                reply = json.loads(line)
            except ValueError:
                break  # it was killed while it wrote
            answer = self._waiting.get(reply["id"])
            if answer is not None:
                answer.set_result(reply)
        lost = {"error": "CommunicationLost", "message": self._epitaph()}
        with self._lock:
            self._ended = True
            waiting = list(self._waiting.values())
        for answer in waiting:
            if not answer.done():
                answer.set_result(lost)

    def _epitaph(self) -> str:
        try:
            code = self._process.wait(_EXIT_S)
        except subprocess.TimeoutExpired:
            self._kill()
            code = self._process.wait()
        why = f"ended by signal {-code}" if code < 0 else f"ended with code {code}: {self._last_words()}"
        return f"the driver's process for {self._host} {why}; the robot has stopped: open the cell again"

    def _last_words(self) -> str:
        if self._log.closed:
            return "closed"
        self._log.seek(0)
        lines = [line.strip() for line in self._log.read().decode(errors="replace").splitlines()]
        return next((line for line in reversed(lines) if line), "it said nothing")

    def _kill(self) -> None:
        self._process.kill()
        self._process.wait()
