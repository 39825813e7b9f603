"""Planner that is a program in any language: it reads frames from npz files and answers in JSON.

A request is a line on its standard input, ``{"frame": PATH, "seed": NUMBER}``; its answer is a line on its
standard output, ``{"grasp": [x, y, z, theta]}``, with ``quality``, ``displacement``, ``displacement_cov``
and ``point_base`` as in `mskgrasp.planning.proposal.ProposedGrasp` if it predicts them, or
``{"refused": REASON}``.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import shlex
import signal
import subprocess
import tempfile
import threading
from pathlib import Path
from typing import Any

import numpy as np

from hal.camera import RgbdFrame
from hal.cell import Workspace
from mskgrasp.core.errors import BadPlanner, NoGraspFound
from mskgrasp.core.grasp import Grasp
from mskgrasp.core.json_text import parse_json
from mskgrasp.planning.proposal import ProposedGrasp

TIMEOUT_S = 60.0
"""Time in which a program must answer, the start of its process included."""
_GRACE_S = 2.0
"""Time in which a program may end by itself."""
# Its input ends when this process does, for whatever reason. The kernel's parent-death signal would need
# preexec_fn, which may deadlock beside threads, and would spare what the program itself has started.
_CLEAN_UP = 'read -r _; kill -KILL "-$1"; rm -rf -- "$2"'
_FIELDS = ("quality", "displacement", "displacement_cov", "point_base")


def write_frame(path: Path, frame: RgbdFrame, workspace: Workspace) -> None:
    """Write a frame as npz.

    ``depth`` (h, w) float32 metres, NaN where invalid; ``colour`` (h, w, 3) uint8; ``intrinsics`` (3, 3);
    ``T_base_camera`` (4, 4), OpenCV's axes; ``table_z`` and ``min_height``, metres; ``region`` (4,): x_min,
    x_max, y_min, y_max in which the part lies, base frame, metres.
    """
    np.savez(
        path,
        depth=np.asarray(frame.depth, dtype=np.float32),
        colour=frame.colour,
        intrinsics=np.asarray(frame.intrinsics, dtype=np.float64),
        T_base_camera=np.asarray(frame.T_base_camera.as_matrix(), dtype=np.float64),
        table_z=workspace.table_z,
        min_height=workspace.min_height,
        region=np.array(workspace.region),
    )


class ProgramPlanner:
    """Process of a program that plans; started with the first request, ended by `close` or with this process.

    Args:
        command: The program and its arguments.
        workspace: Table and region.
        timeout_s: Time in which it must answer, s.
    """

    def __init__(self, command: str, workspace: Workspace, timeout_s: float = TIMEOUT_S):
        self._command = command
        self._workspace = workspace
        self._timeout_s = timeout_s
        self._process: subprocess.Popen[str] | None = None
        self._watch: subprocess.Popen[bytes] | None = None
        self._lines: queue.Queue[str | None] = queue.Queue()
        self._late = ""
        """Why it was ended here, which holds for every later request, too."""
        self._log = tempfile.TemporaryFile()
        self._folder = tempfile.TemporaryDirectory()

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> ProposedGrasp:
        """Plan a grasp of the part in a frame.

        Raises:
            NoGraspFound: The program refuses the part.
            BadPlanner: It cannot be started, ends, does not answer in time, or answers no grasp.
        """
        path = Path(self._folder.name) / "frame.npz"
        write_frame(path, frame, self._workspace)
        line = self._ask(json.dumps({"frame": str(path), "seed": int(rng.integers(2**31))}))
        try:
            return _proposed(parse_json(line))
        except (ValueError, TypeError, LookupError, AttributeError) as error:
            shown = line.strip()[:200]
            raise BadPlanner(
                f"the program {self._command!r} must answer a line such as "
                f'{{"grasp": [0.5, 0.0, 0.02, 0.3]}}, got {shown!r}'
            ) from error

    def close(self) -> None:
        """End the program; safe to call twice."""
        if self._watch is not None:
            with self._watch:
                self._watch.kill()
            self._watch = None
        if self._process is not None:
            assert self._process.stdin is not None and self._process.stdout is not None
            with contextlib.suppress(OSError):
                self._process.stdin.close()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(_GRACE_S)
            _kill(self._process)
            self._reader.join(_GRACE_S)
            if not self._reader.is_alive():  # else what has left the program's session still has its output
                self._process.stdout.close()
            self._process = None
        self._log.close()
        self._folder.cleanup()

    def _ask(self, request: str) -> str:
        if self._late:
            raise BadPlanner(self._late)
        process = self._started()
        assert process.stdin is not None
        if not self._lines.empty():  # would be taken for the answer to this request, and so on
            line = self._lines.get()
            if line is not None:
                _kill(process)
                raise BadPlanner(
                    f"the program {self._command!r} wrote more than one line for a request "
                    f"({line.strip()[:200]!r}); print one answer each, and anything else to stderr"
                )
            self._lines.put(None)
        try:
            process.stdin.write(request + "\n")
            process.stdin.flush()
            line = self._lines.get(timeout=self._timeout_s)
        except queue.Empty:
            _kill(process)
            self._late = (
                f"the program {self._command!r} did not answer within {self._timeout_s:g} s; does it flush "
                "its output?"
            )
            raise BadPlanner(self._late) from None
        except OSError:
            line = None
        if line is None:
            try:
                code = process.wait(_GRACE_S)
            except subprocess.TimeoutExpired:
                _kill(process)
                raise BadPlanner(f"the program {self._command!r} closed its output") from None
            raise BadPlanner(f"the program {self._command!r} ended with exit code {code}{self._last_line()}")
        return line

    def _started(self) -> subprocess.Popen[str]:
        if self._process is None:
            try:
                self._process = subprocess.Popen(
                    shlex.split(self._command),
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=self._log,
                    encoding="utf-8",
                    errors="backslashreplace",
                    # Ctrl-C is for this program, which then ends the other.
                    start_new_session=True,
                )
                self._reader = threading.Thread(target=self._read, args=(self._process,), daemon=True)
                self._reader.start()
                self._watch = subprocess.Popen(
                    ["sh", "-c", _CLEAN_UP, "sh", str(self._process.pid), self._folder.name],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    start_new_session=True,
                )
            except (OSError, ValueError, IndexError) as error:
                raise BadPlanner(f"the program {self._command!r} cannot be started: {error}") from error
        return self._process

    def _read(self, process: subprocess.Popen[str]) -> None:
        assert process.stdout is not None
        for line in process.stdout:
            self._lines.put(line)
        self._lines.put(None)

    def _last_line(self) -> str:
        self._log.seek(0)
        lines = [line.strip() for line in self._log.read().decode(errors="replace").splitlines()]
        last = next((line for line in reversed(lines) if line), "")
        return f" ({last})" if last else ""


def _kill(process: subprocess.Popen[str]) -> None:
    """End a program and what it started, such as the program that a shell waits for."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _proposed(values: dict[str, Any]) -> ProposedGrasp:
    refused = values.get("refused")
    if refused is not None:
        if not isinstance(refused, str) or not refused.strip():
            raise TypeError(f"refused is {refused!r}, not a reason")
        raise NoGraspFound(refused)
    unknown = sorted(set(values) - {"grasp", "refused", *_FIELDS})
    if unknown:
        raise ValueError(f"unknown keys {unknown}")
    known: dict[str, Any] = {name: values[name] for name in _FIELDS if values.get(name) is not None}
    for name in known:
        known[name] = float(known[name]) if name == "quality" else np.array(known[name], dtype=np.float64)
    return ProposedGrasp(grasp=Grasp.from_vector(np.array(values["grasp"], dtype=np.float64)), **known)
