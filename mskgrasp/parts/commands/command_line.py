"""Command line of ``python -m mskgrasp.parts``: build, import, list, show, sheet, rate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import assert_never

from mskgrasp.parts.builtin import builtin_names
from mskgrasp.parts.commands.build import Build, run_build
from mskgrasp.parts.commands.import_ import Import, run_import
from mskgrasp.parts.commands.list_ import List, run_list
from mskgrasp.parts.commands.rate import Rate, run_rate
from mskgrasp.parts.commands.show import Sheet, Show, run_sheet, run_show
from mskgrasp.runtime.options import parse_command

PROG = "python -m mskgrasp.parts"

COMMANDS = {"build": Build, "import": Import, "list": List, "show": Show, "sheet": Sheet, "rate": Rate}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; return the exit code."""
    command = parse_command(
        COMMANDS,
        prog=PROG,
        description=f"Parts for simulation: a catalogue of {len(builtin_names())}, and your own CAD files.",
        argv=argv,
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
