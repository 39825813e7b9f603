"""What ``python -m mskgrasp.parts`` can do: build, import, list, show, sheet, rate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, assert_never

import tyro

from mskgrasp.parts.build import builtin_names
from mskgrasp.parts.commands.build import Build, run_build
from mskgrasp.parts.commands.import_ import Import, run_import
from mskgrasp.parts.commands.list_ import List, run_list
from mskgrasp.parts.commands.rate import Rate, run_rate
from mskgrasp.parts.commands.show import Sheet, Show, run_sheet, run_show

PROG = "python -m mskgrasp.parts"

Verb = (
    Annotated[Build, tyro.conf.subcommand("build")]
    | Annotated[Import, tyro.conf.subcommand("import")]
    | Annotated[List, tyro.conf.subcommand("list")]
    | Annotated[Show, tyro.conf.subcommand("show")]
    | Annotated[Sheet, tyro.conf.subcommand("sheet")]
    | Annotated[Rate, tyro.conf.subcommand("rate")]
)


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one verb; returns the exit code."""
    verb = tyro.cli(
        Verb,  # pyright: ignore[reportArgumentType]
        prog=PROG,
        description=f"Parts for simulation: a catalogue of {len(builtin_names())}, and your own CAD files.",
        args=None if argv is None else list(argv),
    )
    match verb:
        case Build():
            return run_build(verb)
        case Import():
            return run_import(verb)
        case List():
            return run_list(verb)
        case Show():
            return run_show(verb)
        case Sheet():
            return run_sheet(verb)
        case Rate():
            return run_rate(verb)
        case _:
            assert_never(verb)
