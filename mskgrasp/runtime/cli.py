"""Command lines of programs: configuration file, overriding options, exit codes."""

from __future__ import annotations

import argparse
import errno
import itertools
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import tyro
from pydantic import BaseModel
from tyro.constructors import ConstructorRegistry, StructConstructorSpec, StructTypeInfo

from mskgrasp.core.config import check_config, read_config
from mskgrasp.core.errors import BadConfig, MskgraspError, UsageError

ConfigT = TypeVar("ConfigT", bound=BaseModel)


def parse(
    model: type[ConfigT],
    *,
    prog: str,
    description: str,
    default_config: Path | None = None,
    argv: Sequence[str] | None = None,
) -> ConfigT:
    """Builds a program's configuration from defaults, ``--config FILE`` and the other options, in this order.

    Args:
        model: The pydantic model; each of its fields becomes an option, its docstrings the help.
        prog: The command that starts the program, for ``--help``.
        description: What the program does, for ``--help``.
        default_config: The YAML file used where the user gives no ``--config``.
        argv: The arguments; by default those of the process.

    Raises:
        BadConfig: The file or an override is not valid.
    """
    rest, path = _take_config_option(list(sys.argv[1:] if argv is None else argv))
    path = path or default_config
    default = read_config(model, path) if path is not None else None
    note = f" Settings come from --config FILE (default: {default_config}); options override it."
    # Without a file there may be required options: tyro asks for them.
    known: dict[str, Any] = {} if default is None else {"default": default}
    description += note if default_config else ""
    parsed = tyro.cli(model, prog=prog, description=description, args=rest, registry=_registry, **known)
    # No warnings: types are checked next.
    return check_config(model, parsed.model_dump(warnings=False), "command line", name=_option)


def _take_config_option(arguments: list[str]) -> tuple[list[str], Path | None]:
    """Splits ``--config FILE`` off: tyro takes its defaults, which the file holds, before it parses."""
    option = argparse.ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    option.add_argument("--config", type=Path)
    try:
        found, rest = option.parse_known_args(arguments)
    except argparse.ArgumentError as error:
        raise BadConfig("--config needs a file, for example --config configs/collect/demo.yaml") from error
    return rest, found.config


_registry = ConstructorRegistry()


@_registry.struct_rule
def _without_validation(info: StructTypeInfo) -> StructConstructorSpec | None:
    """Has tyro fill models without validating them: it would print pydantic's errors in its own words."""
    if _registry in info.markers or not (isinstance(info.type, type) and issubclass(info.type, BaseModel)):
        return None
    # The marker ends the recursion: tyro's own rule gives the fields.
    spec = ConstructorRegistry.get_struct_spec(replace(info, markers=(*info.markers, _registry)))
    if not isinstance(spec, StructConstructorSpec):
        return None

    def fill(**values: Any) -> BaseModel:
        return info.type.model_construct(**values)

    fill.__doc__ = info.type.__doc__  # for --help
    return replace(spec, instantiate=fill)


def _option(location: tuple[int | str, ...]) -> str:
    """The option that sets a field: ``--camera.n-pixels``."""
    names = itertools.takewhile(lambda part: isinstance(part, str), location)
    return "--" + ".".join(map(str, names)).replace("_", "-")


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
    """Explains an error in one line with the path and the remedy."""
    place = f": {error.filename}" if error.filename else ""
    remedy = "free some space, what is finished is kept" if error.errno in _FULL else "choose another path"
    return f"{error.strerror or error}{place}; {remedy}"


def _heed_ctrl_c(unraisable: Any, report: Callable[[Any], None] = sys.unraisablehook) -> None:
    """One that comes while Python cleans up an object would be reported, and forgotten: it comes again."""
    if unraisable.exc_type is KeyboardInterrupt:
        threading.Timer(0.01, os.kill, (os.getpid(), signal.SIGINT)).start()
    else:
        report(unraisable)


def run(main: Callable[[], int | None]) -> None:
    """Runs a program's ``main`` and ends the process: 0, 1 failure, 2 usage, 130 Ctrl-C.

    An error that a user can correct becomes one line on standard error; anything else is a defect and
    keeps its traceback.
    """
    sys.unraisablehook = _heed_ctrl_c
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})  # it was held while all was imported
        code = main() or 0
    except MskgraspError as error:
        print(f"error: {error}", file=sys.stderr)
        code = error.exit_code
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # who presses it twice wants no more than this
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
