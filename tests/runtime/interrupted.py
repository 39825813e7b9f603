"""Programs that are interrupted by Ctrl-C."""

from __future__ import annotations

import signal
import subprocess
import sys

STOPPED = "stopped by Ctrl-C; what was finished is kept\n"


def interrupted(code: str) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, start_new_session=True, timeout=50,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # where the tests' own is ignored
    )  # fmt: skip
    return done.returncode, done.stderr
