"""Ctrl-C is deferred, and never lost."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.runtime.interrupted import STOPPED, interrupted


def test_ctrl_c_while_python_cleans_up_is_not_lost():
    code = """
import os, signal, time
from mskgrasp.runtime.cli import run

class Scene:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.1)

def main():
    Scene()
    time.sleep(60)

run("program", main)
"""
    assert interrupted(code) == (130, STOPPED)


@pytest.mark.parametrize(
    ("program", "library"),
    [
        ("mskgrasp.plan", "yaml"),
        ("mskgrasp.plan", "numpy"),
        ("mskgrasp.plan", "torch"),
        ("mskgrasp.validate", "yaml"),
        ("mskgrasp plan", "numpy"),
    ],
)
def test_ctrl_c_while_a_program_imports_is_not_lost(program: str, library: str):
    process = subprocess.Popen(
        [sys.executable, "-m", *program.split()], stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    loaded = Path(f"/proc/{process.pid}/maps")
    while f"/{library}/" not in loaded.read_text():
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    assert (process.communicate()[1], process.returncode) == (STOPPED, 130)
