"""Script with which a shell completes the command ``mskgrasp``: its programs, their commands and options."""

from __future__ import annotations

import contextlib
import functools
import importlib
import io
import operator
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import tyro
from pydantic import BaseModel, create_model

from mskgrasp.core.errors import UsageError
from mskgrasp.runtime.options import registry
from mskgrasp.runtime.programs import PROGRAMS, Program

SHELLS = ("bash", "zsh", "tcsh")
"""Shells for which tyro writes scripts."""


def completion_script(shell: str) -> str:
    """The script of a shell, made from the options of all programs.

    Raises:
        UsageError: The shell is none of `SHELLS`.
    """
    if shell not in SHELLS:
        raise UsageError(f"no completion for the shell {shell!r}; legal: {', '.join(SHELLS)}")
    kinds: list[Any] = [
        Annotated[_options(one), tyro.conf.subcommand(name)] for name, one in PROGRAMS.items()
    ]
    programs: Any = functools.reduce(operator.or_, kinds)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.suppress(SystemExit):
        tyro.cli(
            programs,
            prog="mskgrasp",
            args=["--tyro-print-completion", shell],
            registry=registry,
        )
    return "\n".join(_one_line_each(line) for line in printed.getvalue().splitlines())


def _one_line_each(line: str) -> str:
    """Help texts without line breaks, which the script would take for further completions."""
    return line.replace("\\n", " ") if line.startswith("COMPLETION_SPEC = ") else line


def _options(program: Program) -> Any:
    """Type whose fields are a program's options, or the union of its commands' types."""
    module, _, name = program.options.partition(":")
    found = getattr(importlib.import_module(module), name)
    if isinstance(found, Mapping):
        kinds: list[Any] = [Annotated[kind, tyro.conf.subcommand(command)] for command, kind in found.items()]
        return functools.reduce(operator.or_, kinds)
    assert issubclass(found, BaseModel)
    # Read before tyro parses, hence no field.
    return create_model(found.__name__, __base__=found, config=(Path | None, None))
