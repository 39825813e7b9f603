"""Transport between a program and a vendor's driver that runs in a separate process.

A vendor's package may hang, crash, or hold Python's global lock; a process can be killed. Requests and
answers are JSON objects, one a line, on its standard input and output; plain bytes may follow an answer.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from hal.errors import CommunicationLost, HalError


class ProcessEnded(CommunicationLost):
    """The driver's process ended or was killed; the message says how."""


class NoAnswer(ProcessEnded):
    """The driver's process did not answer in time and was killed."""


@dataclass(frozen=True, kw_only=True)
class Answer:
    """Answer of a driver to a request.

    Attributes:
        result: Result, serialisable as JSON.
        payload: Bytes sent after the result.
    """

    result: Any
    payload: Sequence[bytes | memoryview] = ()


# ---------------------------------------------------------------------- the program's side


class DriverProcess:
    """Process of a driver: started, sent requests, and killed when it does not answer in time.

    Args:
        arguments: Arguments of ``python -m``: the driver's module, and its own arguments.
        errors: Errors that the driver may raise, by the names of their classes.
        exit_s: Time the driver has to release its device before its process is killed, s.
    """

    def __init__(self, arguments: Sequence[str], errors: Mapping[str, type[HalError]], exit_s: float):
        self._errors = errors
        self._exit_s = exit_s
        self._lock = threading.Lock()
        self._writing = threading.Lock()
        self._waiting: dict[int, Future[tuple[dict[str, Any], bytes]]] = {}
        self._number = 0
        self._ended = False
        self._log = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            [sys.executable, "-m", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            # Ctrl-C is for the program, which then releases the device; not for the driver under it.
            start_new_session=True,
        )
        assert self._process.stdin is not None
        os.set_blocking(self._process.stdin.fileno(), False)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Process id of the driver."""
        return self._process.pid

    def ask(self, op: str, *, timeout_s: float, **values: Any) -> Answer:
        """Send a request and wait for its answer; requests of several threads may overlap.

        Raises:
            NoAnswer: No answer within ``timeout_s``; the process was killed.
            ProcessEnded: The process has ended.
            HalError: The driver's own error.
        """
        future: Future[tuple[dict[str, Any], bytes]] = Future()
        with self._lock:
            if self._ended:
                raise ProcessEnded(self._how_it_ended())
            self._number += 1
            number = self._number
            self._waiting[number] = future
        deadline_s = time.monotonic() + timeout_s
        try:
            self._send({"id": number, "op": op, **values}, deadline_s)
            reply, payload = future.result(max(0.0, deadline_s - time.monotonic()))
        except TimeoutError:
            self.kill()
            raise NoAnswer(
                f"the driver's process did not answer '{op}' within {timeout_s:.1f} s and was killed"
            ) from None
        finally:
            self._waiting.pop(number, None)
        if "error" in reply:
            raise self._errors[reply["error"]](reply["message"])
        return Answer(result=reply["result"], payload=[payload])

    def close(self) -> None:
        """Let the driver release its device and end the process; safe to call twice."""
        assert self._process.stdin is not None and self._process.stdout is not None
        with self._writing:
            self._process.stdin.close()
        try:
            self._process.wait(self._exit_s)
        except subprocess.TimeoutExpired:
            self.kill()
        self._reader.join()
        self._process.stdout.close()
        self._log.close()

    def kill(self) -> None:
        """End the process at once; its device is left to the kernel."""
        self._process.kill()
        self._process.wait()

    def _send(self, request: dict[str, Any], deadline_s: float) -> None:
        """Write a request; a driver that hangs reads none, and a request may be longer than the pipe.

        Raises:
            TimeoutError: It could not be written in time.
            ProcessEnded: The process has ended.
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
            raise ProcessEnded(self._how_it_ended()) from None
        finally:
            self._writing.release()

    def _read(self) -> None:
        stdout = self._process.stdout
        assert stdout is not None
        for line in stdout:
            try:
                reply = json.loads(line)
            except ValueError:
                break  # killed while it wrote
            payload = stdout.read(reply["n_bytes"])
            if len(payload) < reply["n_bytes"]:
                break
            future = self._waiting.get(reply["id"])
            if future is not None:
                future.set_result((reply, payload))
        message = self._how_it_ended()
        with self._lock:
            self._ended = True
            waiting = list(self._waiting.values())
        for future in waiting:
            if not future.done():
                future.set_exception(ProcessEnded(message))

    def _how_it_ended(self) -> str:
        try:
            code = self._process.wait(self._exit_s)
        except subprocess.TimeoutExpired:  # its pipe is closed, the process still runs
            self.kill()
            code = self._process.wait()
        if code < 0:
            return f"the driver's process was ended by {signal.Signals(-code).name}{self._last_line()}"
        return f"the driver's process ended with exit code {code}{self._last_line()}"

    def _last_line(self) -> str:
        if self._log.closed:
            return ""
        # Both ends share the file's position; `pread` leaves it where the driver writes.
        size = os.fstat(self._log.fileno()).st_size
        text = os.pread(self._log.fileno(), size, 0).decode(errors="replace")
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        return f" ({lines[-1]})" if lines else ""


# ---------------------------------------------------------------------- the driver's side


class AnswerPipe:
    """Standard output of a driver's process, reserved for answers; a vendor's prints go to the log."""

    def __init__(self) -> None:
        self._stream = os.fdopen(os.dup(1), "wb")
        os.dup2(2, 1)
        self._lock = threading.Lock()

    def answer(
        self,
        request: Mapping[str, Any],
        action: Callable[[], Answer],
        explain: Callable[[BaseException], HalError],
    ) -> None:
        """Run an action and write its answer, or the error that explains why it failed.

        Args:
            request: As `requests` yields it. With ``alarm_s`` the kernel ends the process when the action
                takes longer: the program may have been killed, and Python's lock may be held.
            action: Performs the request.
            explain: Converts an exception of the vendor to an error of `hal`.
        """
        payload: Sequence[bytes | memoryview] = ()
        try:
            if "alarm_s" in request:
                signal.alarm(request["alarm_s"])
            try:
                answer = action()
            finally:
                if "alarm_s" in request:
                    signal.alarm(0)
            line = self._line(request, answer.payload, result=answer.result)
            payload = answer.payload
        except BaseException as error:  # every exception of a vendor must reach the program
            fault = explain(error)
            line = self._line(request, error=type(fault).__name__, message=str(fault))
        # A program that is gone reads nothing; the requests end next, and the driver releases its device.
        with self._lock, contextlib.suppress(BrokenPipeError):
            self._stream.write(line)
            for part in payload:
                self._stream.write(part)
            self._stream.flush()

    @staticmethod
    def _line(request: Mapping[str, Any], payload: Sequence[bytes | memoryview] = (), **reply: Any) -> bytes:
        n_bytes = sum(len(part) for part in payload)
        return json.dumps({"id": request["id"], "n_bytes": n_bytes, **reply}).encode() + b"\n"


def requests() -> Iterator[dict[str, Any]]:
    """Requests on standard input, until the program closes it or dies."""
    for line in sys.stdin:
        if not line.endswith("\n"):
            return  # the program died while it wrote
        yield json.loads(line)
