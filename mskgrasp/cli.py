"""What every program shares: a configuration file, overrides from the command line, clean exits."""

from __future__ import annotations

import errno
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import tyro
from pydantic import BaseModel, ValidationError

from mskgrasp.config import check_config, read_config
from mskgrasp.errors import BadConfig, MskgraspError, UsageError

ConfigT = TypeVar("ConfigT", bound=BaseModel)


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
    rest, path = _take_config_option(list(sys.argv[1:] if argv is None else argv))
    path = path or default_config
    default = read_config(model, path) if path is not None else None
    note = f" Settings come from --config FILE (default: {default_config}); options override it."
    try:
        # Without a file there may be required options: let tyro ask for them.
        if default is None:
            parsed = tyro.cli(model, prog=prog, description=description, args=rest)
        else:
            parsed = tyro.cli(
                model,
                prog=prog,
                description=description + (note if default_config else ""),
                default=default,
                args=rest,
            )
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise BadConfig(f"--{key}: {first['msg'].lower()}, got {first.get('input')!r}") from error
    return check_config(model, parsed.model_dump(), "command line")


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


def run(main: Callable[[], int | None]) -> None:
    """Runs a program's ``main`` and ends the process: 0, 1 failure, 2 usage, 130 Ctrl-C.

    An error that a user can mend becomes one line on standard error; anything else is a defect and
    keeps its traceback.
    """
    try:
        code = main() or 0
    except MskgraspError as error:
        print(f"error: {error}", file=sys.stderr)
        code = error.exit_code
    except KeyboardInterrupt:
        print("stopped by Ctrl-C; what was finished is kept", file=sys.stderr)
        code = 130
    except BrokenPipeError:
        sys.stderr.close()
        code = 0
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EACCES, errno.EROFS, errno.EDQUOT):
            raise
        place = f" ({error.filename})" if error.filename else ""
        print(f"error: {error.strerror}{place}: free some space or choose another --out", file=sys.stderr)
        code = 1
    sys.exit(code)
