"""Clean exits of programs: exit codes, one-line errors, Ctrl-C, output folders."""

from __future__ import annotations

import errno
import io
import os
import select
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TextIO

from mskgrasp.core.errors import MskgraspError, UsageError, one_line
from mskgrasp.runtime.ctrl_c import repeat_dropped_ctrl_c
from mskgrasp.runtime.memory import keep_freed_memory


def make_folder(path: Path) -> None:
    """Make an output folder.

    Raises:
        UsageError: A file is in the way, or the place is not writable.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"cannot make folder {path}: {error.strerror}; choose another --out") from error


def check_folder(path: Path) -> None:
    """Refuse an output folder that cannot be made; make nothing.

    Raises:
        UsageError: A file is in the way, or the place is not writable.
    """
    nearest = next(one for one in (path.absolute(), *path.absolute().parents) if one.exists())
    if not nearest.is_dir():
        raise UsageError(f"cannot make folder {path}: {nearest} is a file; choose another --out")
    if not os.access(nearest, os.W_OK):
        raise UsageError(f"cannot make folder {path}: {nearest} is not writable; choose another --out")


_FULL = (errno.ENOSPC, errno.EDQUOT)
_REMEDIES = {
    **dict.fromkeys(_FULL, "free some space, what is finished is kept"),
    **dict.fromkeys((errno.EMFILE, errno.ENFILE), "raise the limit of open files: ulimit -n 4096"),
    **dict.fromkeys((errno.EIO, errno.ESTALE), "check the disk, then start again"),
}


def explain_os_error(error: OSError) -> str:
    """Explain an error in one line with the path and the remedy."""
    place = f": {error.filename}" if error.filename else ""
    remedy = _REMEDIES.get(error.errno or 0, "choose another path")
    return f"{error.strerror or error}{place}; {remedy}"


def _is_unread(stream: TextIO) -> bool:
    """Whether it is a pipe whose reader has closed it."""
    try:
        poll = select.poll()
        poll.register(stream.fileno(), 0)
        return any(event & (select.POLLERR | select.POLLHUP) for _, event in poll.poll(0))
    except (OSError, ValueError):  # closed, or no file of the system's
        return False


def run(program: str, main: Callable[[], int | None]) -> None:
    """Run a program's ``main`` and end the process: 0, 1 failure, 2 usage, 130 Ctrl-C, 141 output unread.

    An error that a user can repair becomes one line on standard error; anything else is a defect and
    keeps its traceback.

    Args:
        program: Name of the program, before its errors.
        main: The program; a ``__main__`` imports it here, by `ctrl_c_deferred`, and not before, so that
            Ctrl-C meanwhile has the same effect as later.
    """
    sys.unraisablehook = repeat_dropped_ctrl_c
    keep_freed_memory()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # A file's name need not be text; and what is printed shows at once, in a pipe, too.
            stream.reconfigure(errors="backslashreplace", line_buffering=True)
    try:
        code = main() or 0
    except MskgraspError as error:
        print(f"{program}: {one_line(error)}", file=sys.stderr)
        code = error.exit_code
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # a second one must not interrupt the exit
        print("stopped by Ctrl-C; what was finished is kept", file=sys.stderr)
        code = 130
    except BrokenPipeError:
        unread = [stream for stream in (sys.stdout, sys.stderr) if _is_unread(stream)]
        if not unread:
            raise  # another pipe's: a defect
        for stream in unread:  # what they still hold must not fail again at the exit
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        code = 128 + signal.SIGPIPE  # as of a process that the signal ends
    except OSError as error:
        if error.filename is None and error.errno not in _FULL:
            raise
        print(f"{program}: {one_line(explain_os_error(error))}", file=sys.stderr)
        code = 1
    sys.exit(code)
