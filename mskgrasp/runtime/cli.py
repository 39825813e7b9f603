"""Command lines and exits of programs; imports the standard library alone, so that `run` is ready at once."""

from __future__ import annotations

import contextlib
import errno
import io
import re
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from mskgrasp.core.errors import BadConfig, MskgraspError, UsageError
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred, repeat_dropped_ctrl_c

if TYPE_CHECKING:
    from pydantic import BaseModel

ConfigT = TypeVar("ConfigT", bound="BaseModel")


def parse(
    model: type[ConfigT],
    *,
    prog: str,
    description: str,
    default_config: Path | None = None,
    argv: Sequence[str] | None = None,
) -> ConfigT:
    """Builds a program's configuration: defaults, then ``--config FILE``, then the other options.

    Args:
        model: The pydantic model; each of its fields becomes an option, its docstrings the help.
        prog: How the program is called, for ``--help``.
        description: What the program does, for ``--help``.
        default_config: The YAML file used where the user gives no ``--config``.
        argv: The arguments; the process's own by default.

    Raises:
        BadConfig: The file or an override is not valid.
    """
    with ctrl_c_deferred():
        import tyro

        from mskgrasp.core.config import check_config, read_config

    rest, path = _take_config_option(list(sys.argv[1:] if argv is None else argv))
    path = path or default_config
    default = read_config(model, path) if path is not None else None
    note = f" Settings come from --config FILE (default: {default_config}); options override it."
    # Without a file there may be required options: tyro asks for them.
    known: dict[str, Any] = {} if default is None else {"default": default}
    description += note if default_config else ""
    printed = io.StringIO()
    try:
        with contextlib.redirect_stderr(printed):
            parsed = tyro.cli(model, prog=prog, description=description, args=rest, **known)
    except SystemExit:
        _raise_range_error(printed.getvalue())
        sys.stderr.write(printed.getvalue())
        raise
    return check_config(model, parsed.model_dump(), "command line")


def _raise_range_error(printed: str) -> None:
    """Raises in one line what tyro quotes from pydantic in a box; does nothing for tyro's own messages."""
    text = " ".join(re.sub(r"[│╭╮╰╯─]", " ", printed).split())
    found = re.search(
        r"validation errors? for \S+ (?:([\w.]+) )?"
        r"((?:Input should|Value error).*?) \[type=\w+, input_value=(.*?), input_",
        text,
    )
    if found:
        name, problem, value = found.groups()
        option = f"--{name.replace('_', '-')}: " if name else ""
        raise BadConfig(f"command line: {option}{problem.removeprefix('Value error, ')}, got {value}")


def _take_config_option(arguments: list[str]) -> tuple[list[str], Path | None]:
    path = None
    rest = []
    pending = iter(arguments)
    for argument in pending:
        if argument == "--config":
            value = next(pending, None)
            if value is None:
                raise BadConfig("--config needs a file, for example --config configs/collect/demo.yaml")
            path = Path(value)
        elif argument.startswith("--config="):
            path = Path(argument.removeprefix("--config="))
        else:
            rest.append(argument)
    return rest, path


def make_folder(path: Path) -> None:
    """Makes an output folder.

    Raises:
        UsageError: A file is in the way, or the place is not writable.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"cannot make folder {path}: {error.strerror}; choose another --out") from error


_FULL = (errno.ENOSPC, errno.EDQUOT)


def explain_os_error(error: OSError) -> str:
    """One line: what failed, where, and the remedy."""
    place = f": {error.filename}" if error.filename else ""
    remedy = "free some space, what is finished is kept" if error.errno in _FULL else "choose another path"
    return f"{error.strerror or error}{place}; {remedy}"


def run(main: Callable[[], int | None]) -> None:
    """Runs a program's ``main`` and ends the process: 0, 1 failure, 2 usage, 130 Ctrl-C.

    An error that a user can repair becomes one line on standard error; anything else is a defect and
    keeps its traceback.

    Args:
        main: The program; a ``__main__`` imports it here, by `ctrl_c_deferred`, and not before, so that
            Ctrl-C meanwhile has the same effect as later.
    """
    sys.unraisablehook = repeat_dropped_ctrl_c
    try:
        code = main() or 0
    except MskgraspError as error:
        print(f"error: {error}", file=sys.stderr)
        code = error.exit_code
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # a second one must not interrupt the exit
        print("stopped by Ctrl-C; what was finished is kept", file=sys.stderr)
        code = 130
    except BrokenPipeError:
        sys.stderr.close()
        code = 0
    except OSError as error:
        if error.filename is None and error.errno not in _FULL:
            raise
        print(f"error: {explain_os_error(error)}", file=sys.stderr)
        code = 1
    sys.exit(code)
