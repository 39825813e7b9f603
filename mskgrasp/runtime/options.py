"""A program's configuration from its file and its command line."""

from __future__ import annotations

import argparse
import functools
import itertools
import operator
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, TypeVar

import tyro
from pydantic import BaseModel
from tyro.constructors import ConstructorRegistry, StructConstructorSpec, StructTypeInfo

from mskgrasp.core.config import check_config, read_config
from mskgrasp.core.errors import BadConfig, UsageError
from mskgrasp.runtime.option_errors import parse_arguments
from mskgrasp.runtime.programs import guide

ConfigT = TypeVar("ConfigT", bound=BaseModel)
CommandT = TypeVar("CommandT")


def parse(
    model: type[ConfigT],
    *,
    prog: str,
    description: str,
    default_config: Path | None = None,
    argv: Sequence[str] | None = None,
) -> ConfigT:
    """Build a program's configuration from defaults, ``--config FILE`` and the other options, in this order.

    Args:
        model: The pydantic model; each of its fields becomes an option, its docstrings the help.
        prog: The command that starts the program, for ``--help``.
        description: Purpose of the program, for ``--help``.
        default_config: The YAML file used where the user gives no ``--config``.
        argv: The arguments; the process's own by default.

    Raises:
        BadConfig: The file or an override is not valid.
        UsageError: An option is unknown, or has no value or one of another type.
    """
    rest, path = _take_config_option(list(sys.argv[1:] if argv is None else argv))
    # The files' word for nothing, which the help uses, too.
    says_nothing = "null" in rest
    rest = ["None" if word == "null" else word for word in rest]
    path = path or default_config
    default = read_config(model, path) if path is not None else None
    origin = f" (default: {default_config})" if default_config else ""
    note = f"\n\nSettings come from --config FILE, a YAML file of these options{origin}; options override it."
    # Without a file there may be required options: tyro demands them.
    known: dict[str, Any] = {} if default is None else {"default": default}
    description += note + _guide(prog)
    parsed = parse_arguments(
        model, rest, prog=prog, also_legal=["--config"], description=description, registry=registry, **known
    )
    values = parsed.model_dump(warnings=False)  # types are checked next
    if says_nothing:
        _refuse_the_word(values, ())
    return check_config(model, values, "command line", name=_option)


def _refuse_the_word(values: Any, location: tuple[str, ...]) -> None:
    """Refuse a null that was taken for a text, since the option must have a value."""
    if isinstance(values, dict):
        for key, value in values.items():
            _refuse_the_word(value, (*location, str(key)))
    elif isinstance(values, list | tuple):
        for value in values:
            _refuse_the_word(value, location)
    elif values is not None and str(values) == "None":
        raise UsageError(f"{_option(location)} cannot be null; give a value, or omit it for the default")


def parse_command(
    commands: Mapping[str, type[CommandT]], *, prog: str, description: str, argv: Sequence[str] | None = None
) -> CommandT:
    """Read a command and its options.

    Args:
        commands: Dataclasses by the command's name; each field is an option, the docstrings are the help.
        prog: As for `parse`.
        description: As for `parse`.
        argv: As for `parse`.

    Raises:
        UsageError: The command or an option is unknown, or an option has no value or one of another type.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    name = arguments[0] if arguments else ""
    if name and name not in commands and not name.startswith("-"):
        raise UsageError(f"unknown command {name!r}; legal: {', '.join(commands)}")
    kinds = [Annotated[kind, tyro.conf.subcommand(name)] for name, kind in commands.items()]
    union = functools.reduce(operator.or_, kinds)
    return parse_arguments(
        union, arguments, prog=prog, options_of=commands.get(name), description=description + _guide(prog)
    )


def _guide(prog: str) -> str:
    """The last paragraph of a description: the page about the program."""
    line = guide(prog)
    return f"\n\n{line}" if line else ""


def _take_config_option(arguments: list[str]) -> tuple[list[str], Path | None]:
    """Split ``--config FILE`` off: tyro takes its defaults, which the file holds, before it parses."""
    option = argparse.ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    option.add_argument("--config", type=Path)
    try:
        found, rest = option.parse_known_args(arguments)
    except argparse.ArgumentError as error:
        raise BadConfig("--config needs a file, for example --config configs/collect/demo.yaml") from error
    return rest, found.config


registry = ConstructorRegistry()
"""Rules by which tyro makes configurations."""


@registry.struct_rule
def _without_validation(info: StructTypeInfo) -> StructConstructorSpec | None:
    """Have tyro fill models without validating them: it would print pydantic's errors in its own words."""
    if registry in info.markers or not (isinstance(info.type, type) and issubclass(info.type, BaseModel)):
        return None
    # The marker ends the recursion: tyro's own rule gives the fields.
    spec = ConstructorRegistry.get_struct_spec(replace(info, markers=(*info.markers, registry)))
    if not isinstance(spec, StructConstructorSpec):
        return None

    def fill(**values: Any) -> BaseModel:
        return info.type.model_construct(**values)

    fill.__doc__ = info.type.__doc__  # for --help
    fields = tuple(
        replace(field, helptext=functools.partial(_unbroken, field.helptext)) for field in spec.fields
    )
    return replace(spec, instantiate=fill, fields=fields)


def _unbroken(text: str | Callable[[], str | None] | None) -> str | None:
    """The text of an option without the line breaks of the source: tyro keeps those and adds its own."""
    found = text() if callable(text) else text
    return None if found is None else " ".join(found.split())


def _option(location: tuple[int | str, ...]) -> str:
    """The option that sets a field: ``--camera.n-pixels``."""
    names = itertools.takewhile(lambda part: isinstance(part, str), location)
    return "--" + ".".join(map(str, names)).replace("_", "-")
