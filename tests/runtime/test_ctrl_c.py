"""Ctrl-C is deferred, and never lost."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from mskgrasp.runtime.ctrl_c import ctrl_c_deferred, repeat_dropped_ctrl_c
from tests.runtime.interrupted import STOPPED, interrupted


@pytest.fixture
def python_hears_ctrl_c() -> Iterator[None]:
    """Python's own handler, where the tests' own is another or ignores the signal."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_while_python_cleans_up_is_not_lost():
    """However busy other threads are."""
    code = """
import os, signal, threading, time
from mskgrasp.runtime.cli import run

def spin():
    while True:
        pass

class Scene:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.1)

def main():
    for _ in range(8):
        threading.Thread(target=spin, daemon=True).start()
    Scene()
    time.sleep(60)

run("program", main)
"""
    assert interrupted(code) == (130, STOPPED)


@pytest.mark.parametrize(
    ("program", "library"),
    [
        ("mskgrasp.plan", "yaml"),
        pytest.param("mskgrasp.plan", "numpy", marks=pytest.mark.slow),
        pytest.param("mskgrasp.plan", "torch", marks=pytest.mark.slow),
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


def test_ctrl_c_within_the_block_takes_effect_at_its_end(python_hears_ctrl_c):
    done = []
    with pytest.raises(KeyboardInterrupt), ctrl_c_deferred():
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        done.append("the block ends")
    assert done == ["the block ends"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_error_in_the_block_does_not_lose_ctrl_c(python_hears_ctrl_c):
    with pytest.raises(KeyboardInterrupt) as raised, ctrl_c_deferred():
        signal.raise_signal(signal.SIGINT)
        raise ImportError("half a library")
    assert isinstance(raised.value.__context__, ImportError)


def test_other_threads_leave_the_handler_alone(python_hears_ctrl_c):
    seen = []

    def work() -> None:
        with ctrl_c_deferred():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]


def test_what_python_drops_and_is_no_ctrl_c_is_reported_as_before():
    reported = []

    class Dropped:
        exc_type = ValueError

    repeat_dropped_ctrl_c(Dropped, reported.append)
    assert reported == [Dropped]
