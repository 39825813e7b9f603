"""Reports on the console."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.console import Console
from rich.table import Table as ConsoleTable
from rich.text import Text

from mskgrasp.reports.section import Section, Table, cell_text

_PIPE_WIDTH = 240
"""Characters: wide enough that no table is wrapped in a file."""


def report_console() -> Console:
    """A console on standard output, wide where that is no terminal."""
    console = Console()
    return console if console.is_terminal else Console(width=_PIPE_WIDTH)


def print_sections(sections: Sequence[Section], console: Console | None = None) -> None:
    """Prints the text and the tables of the sections that are not for the page only.

    Args:
        sections: In their order; one without text and tables is left out.
        console: Where to; None: `report_console`.
    """
    console = console or report_console()
    for section in sections:
        if section.page_only or not (section.text or section.tables):
            continue
        console.print(Text(f"\n{section.title}", style="bold"))
        for paragraph in section.text:
            console.print(Text(paragraph), soft_wrap=True)
        for table in section.tables:
            if table.caption:
                console.print(Text(table.caption), soft_wrap=True)
            console.print(_console_table(table))


def _console_table(table: Table) -> ConsoleTable:
    rows = [[Text(cell_text(cell)) for cell in row] for row in table.rows]
    last = rows.pop() if table.total and rows else None
    shown = ConsoleTable(
        box=box.SIMPLE, pad_edge=False, show_header=any(table.header), show_footer=last is not None
    )
    for k, (name, kind) in enumerate(zip(table.header, table.kinds(), strict=True)):
        shown.add_column(
            Text(name), last[k] if last is not None else "", justify="right" if kind == "number" else "left"
        )
    for row in rows:
        shown.add_row(*row)
    return shown
