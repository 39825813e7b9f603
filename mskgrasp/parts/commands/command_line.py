"""Command line of ``python -m mskgrasp.parts``: build, import, list, show, sheet, rate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, assert_never

import tyro

from mskgrasp.parts.builtin import builtin_names
from mskgrasp.parts.commands.build import Build, run_build
from mskgrasp.parts.commands.import_ import Import, run_import
from mskgrasp.parts.commands.list_ import List, run_list
from mskgrasp.parts.commands.rate import Rate, run_rate
from mskgrasp.parts.commands.show import Sheet, Show, run_sheet, run_show

PROG = "python -m mskgrasp.parts"

Command = (
    Annotated[Build, tyro.conf.subcommand("build")]
    | Annotated[Import, tyro.conf.subcommand("import")]
    | Annotated[List, tyro.conf.subcommand("list")]
    | Annotated[Show, tyro.conf.subcommand("show")]
    | Annotated[Sheet, tyro.conf.subcommand("sheet")]
    | Annotated[Rate, tyro.conf.subcommand("rate")]
)


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command; returns the exit code."""
    command = tyro.cli(
        Command,  # pyright: ignore[reportArgumentType]
        prog=PROG,
        description=f"Parts for simulation: a catalogue of {len(builtin_names())}, and your own CAD files.",
        args=None if argv is None else list(argv),
    )
    match command:
        case Build():
            return run_build(command)
        case Import():
            return run_import(command)
        case List():
            return run_list(command)
        case Show():
            return run_show(command)
        case Sheet():
            return run_sheet(command)
        case Rate():
            return run_rate(command)
        case _:
            assert_never(command)
