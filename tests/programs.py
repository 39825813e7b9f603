"""Programs for tests: in processes of their own, or in this one, which has imported everything already."""

from __future__ import annotations

import io
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass

import pytest

from mskgrasp.runtime import cli

# A shell's background job ignores Ctrl-C, and so would all that it starts: pytest, and the program.
_HEAR = (
    "import runpy, signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "sys.argv = sys.argv[1:]; runpy.run_module(sys.argv[0], run_name='__main__', alter_sys=True)"
)


@contextmanager
def running(module: str, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """``python -m module`` that hears Ctrl-C however the tests were started, and ends with the block.

    It has no terminal, so that a signal is sent to it alone.
    """
    with subprocess.Popen(
        [sys.executable, "-c", _HEAR, module, *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


@contextmanager
def no_file_opens() -> Iterator[None]:
    """Within the block every attempt to open a file fails: too many are open."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (0, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


@dataclass(frozen=True)
class Ended:
    """A program that ran to its end."""

    returncode: int
    stdout: str
    stderr: str


def run_here(main: Callable[[], int | None], *arguments: str) -> Ended:
    """What a program's ``main`` prints and how it ends, as if it were called with these arguments."""
    with (
        pytest.MonkeyPatch.context() as patch,
        redirect_stdout(io.StringIO()) as printed,
        redirect_stderr(io.StringIO()) as complained,
        pytest.raises(SystemExit) as ended,
    ):
        patch.setattr(sys, "argv", ["program", *arguments])
        cli.run("program", main)
    return Ended(int(ended.value.code or 0), printed.getvalue(), complained.getvalue())
