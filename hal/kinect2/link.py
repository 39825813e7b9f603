"""The other end of the driver's process: requests with a deadline, typed errors, and no way to hang."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any

from hal.errors import (
    CaptureFailed,
    CommunicationLost,
    DriverMissing,
    HalError,
    IncompatibleDriver,
    NotConnected,
)

_ERRORS: dict[str, type[HalError]] = {
    kind.__name__: kind
    for kind in (CaptureFailed, CommunicationLost, DriverMissing, IncompatibleDriver, NotConnected)
}
_CHATTER = ("[Info]", "[Debug]")
"""How libfreenect2 marks lines that tell nothing about a fault."""
_EXIT_S = 3.0
"""How long the driver may take to stop the stream, s; then its process is killed."""


class ProcessEnded(Exception):
    """The driver's process ended or was killed; the message says how."""


class WorkerLink:
    """Starts the driver's process; ``ask`` never waits longer than it is told."""

    def __init__(self) -> None:
        self._log = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "hal.kinect2.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            # Ctrl-C is for the program, not for the driver under it.
            start_new_session=True,
        )

    def ask(
        self, request: dict[str, Any], *, timeout_s: float, n_bytes: int = 0
    ) -> tuple[dict[str, Any], bytes]:
        """Sends a request and waits for its answer and the ``n_bytes`` that follow a good one.

        Raises:
            ProcessEnded: It crashed, or did not answer within ``timeout_s`` and was killed.
            HalError: What the driver answered.
        """
        try:
            return self._ask(request, time.monotonic() + timeout_s, n_bytes)
        except (ProcessEnded, HalError):
            raise
        except BaseException:
            # Ctrl-C leaves half an answer in the pipe: the next request would get a frame from before it.
            self._kill()
            raise

    def _ask(self, request: dict[str, Any], deadline_s: float, n_bytes: int) -> tuple[dict[str, Any], bytes]:
        try:
            assert self._process.stdin is not None
            self._process.stdin.write(json.dumps(request).encode() + b"\n")
            self._process.stdin.flush()
        except OSError:
            raise ProcessEnded(self._epitaph()) from None
        buffer = b""
        while b"\n" not in buffer:
            buffer += self._read(deadline_s)
        line, _, rest = buffer.partition(b"\n")
        reply = json.loads(line)
        if "error" in reply:
            raise _ERRORS[reply["error"]](reply["message"])
        parts, received = [rest], len(rest)
        while received < n_bytes:
            parts.append(self._read(deadline_s))
            received += len(parts[-1])
        return reply, b"".join(parts)

    def close(self) -> None:
        """Ends the process; safe to call twice."""
        process = self._process
        assert process.stdin is not None and process.stdout is not None
        try:
            process.stdin.close()
        except OSError:
            pass  # it is gone already
        try:
            process.wait(_EXIT_S)
        except subprocess.TimeoutExpired:
            self._kill()
        process.stdout.close()
        self._log.close()

    def _read(self, deadline_s: float) -> bytes:
        assert self._process.stdout is not None
        descriptor = self._process.stdout.fileno()
        ready, _, _ = select.select([descriptor], [], [], max(0.0, deadline_s - time.monotonic()))
        if not ready:
            self._kill()
            raise ProcessEnded("the driver hung and was ended")
        data = os.read(descriptor, 1 << 20)
        if not data:
            raise ProcessEnded(self._epitaph())
        return data

    def _epitaph(self) -> str:
        try:
            code = self._process.wait(_EXIT_S)
        except subprocess.TimeoutExpired:  # its pipe is closed, it is not
            self._kill()
            code = self._process.wait()
        how = f"exit code {code}" if code >= 0 else signal.Signals(-code).name
        self._log.seek(0)
        lines = [
            line.strip() for line in self._log.read().decode(errors="replace").splitlines() if line.strip()
        ]
        return f"the driver's process ended with {how}" + (f" ({lines[-1]})" if lines else "")

    def _kill(self) -> None:
        self._process.kill()
        self._process.wait()
