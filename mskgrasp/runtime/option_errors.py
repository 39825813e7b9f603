"""Parsing by tyro with one-line errors in place of its boxes."""

from __future__ import annotations

import difflib
import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, get_args, get_type_hints

import tyro

# Private, but tyro's only means of reporting errors otherwise than in a box.
from tyro import _errors

from mskgrasp.core.errors import UsageError


def parse_arguments(
    kind: Any,
    arguments: Sequence[str],
    *,
    prog: str,
    options_of: Any = None,
    also_legal: Sequence[str] = (),
    **settings: Any,
) -> Any:
    """Parse arguments into an instance of a type.

    Args:
        kind: Type that tyro makes: a configuration, or a union of subcommands.
        arguments: The command line without the program's name.
        prog: The command that starts the program.
        options_of: Type whose fields are suggested for an unknown option; ``kind`` by default.
        also_legal: More options to suggest.
        settings: Further arguments of `tyro.cli`.

    Raises:
        UsageError: An argument is unknown, missing, or of another type.
    """

    def refuse(event: _errors.ParseErrorEvent) -> None:
        problem = _explain(event, arguments, [*_options(options_of or kind), *also_legal])
        if problem:  # else tyro prints its box
            raise UsageError(f"{problem}; {event.prog} --help lists what is legal")

    with _errors.on_parse_error(refuse):
        return tyro.cli(kind, prog=prog, args=arguments, **settings)


def _explain(event: _errors.ParseErrorEvent, arguments: Sequence[str], legal: Sequence[str]) -> str:
    match event:
        case (
            _errors.UnrecognizedArgs(tokens=[first, *_])
            | _errors.MissingArgs(unrecognized_tokens=[first, *_])
        ) if first.startswith("-"):
            name = first.partition("=")[0]
            if name in legal:  # with another choice among alternatives
                return f"{name} belongs to settings that are not chosen; choose them in the --config file"
            similar = difflib.get_close_matches(name, legal)
            if not similar and Path(first).exists():
                return f"unknown option {first}; of a file write ./{first}"
            return f"unknown option {first}" + (f"; similar: {', '.join(similar)}" if similar else "")
        case _errors.UnrecognizedArgs(tokens=[first, *_]):
            return f"unexpected argument {first!r}"
        case _errors.InvalidChoice(argument=argument, value=value, choices=[only]):
            return f"{argument.display_name()} is {only!r} here; only a --config file chooses {value!r}"
        case _errors.InvalidChoice(argument=argument, value=value, choices=choices):
            return f"{argument.display_name()}: {value!r} is not legal; legal: {', '.join(choices)}"
        case _errors.BadValue(argument=argument, reason="too_few_values"):
            return f"{argument.display_name()} needs {_form(argument)}"
        case _errors.InstantiationFailure(argument=argument) if argument is not None:
            given = _given(argument, arguments)
            return f"{argument.display_name()} needs {_form(argument)}" + (f", got {given}" if given else "")
        case _errors.MissingArgs(missing_arguments=missing):
            names = (f"{one.arg.display_name()} ({_form(one.arg)})" for one in missing)
            return f"missing: {', '.join(names)}"
        case _errors.MissingSubcommand(subcommand_spec=commands):
            return f"a command is missing; legal: {', '.join(commands.parser_from_name)}"
    return ""


def _form(argument: Any) -> str:
    """Form of an argument's value as ``--help`` shows it."""
    return str(argument.lowered.metavar)


def _given(argument: Any, arguments: Sequence[str]) -> str:
    """The value that the command line gives to an option; empty for positional arguments."""
    for i, word in enumerate(arguments):
        name, equals, value = word.partition("=")
        if name.replace("_", "-") in argument.lowered.name_or_flags:
            after = itertools.takewhile(lambda one: not one.startswith("--"), arguments[i + 1 :])
            return value if equals else " ".join(after)
    return ""


def _options(kind: Any, prefix: str = "--") -> Iterator[str]:
    """Options that set the fields of a configuration or a command."""
    fields = getattr(kind, "model_fields", None) or getattr(kind, "__dataclass_fields__", {})
    for name, hint in get_type_hints(kind, include_extras=True).items() if fields else ():
        notes = getattr(hint, "__metadata__", ())
        if name not in fields or tyro.conf.Positional in notes or tyro.conf.Suppress in notes:
            continue
        shown = next((note.name for note in notes if getattr(note, "name", None)), name).replace("_", "-")
        groups = [one for one in _types(hint) if hasattr(one, "model_fields")]
        for group in groups:
            yield from _options(group, f"{prefix}{shown}.")
        if not groups:
            yield prefix + shown


def _types(hint: Any) -> Iterator[Any]:
    yield hint
    for inner in get_args(hint):
        yield from _types(inner)
