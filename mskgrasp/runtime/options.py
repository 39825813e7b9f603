"""A program's configuration from its file and its command line."""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import tyro
from pydantic import BaseModel
from tyro.constructors import ConstructorRegistry, StructConstructorSpec, StructTypeInfo

from mskgrasp.core.config import check_config, read_config
from mskgrasp.core.errors import BadConfig

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
        argv: The arguments; the process's own by default.

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
