"""Tables of programs, and how they are printed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from rich import box
from rich.console import Console
from rich.padding import Padding
from rich.table import Table as ConsoleTable
from rich.text import Text

from mskgrasp.core.errors import printable

Kind = Literal["number", "word", "prose"]
_NUMBER = re.compile(r"[+\-−]?\d.*|[-–]?")
_LONG = 40
"""Characters; a column with a longer cell is wrapped."""
_LONG_WORD = 16
"""Characters; a longer word, such as a path, may be broken."""
_BETWEEN = 3
"""Characters between two columns."""
_PIPE_WIDTH = 10_000
"""Characters: wide enough that no table is wrapped in a file."""


@dataclass(frozen=True, kw_only=True)
class Link:
    """A cell that leads to a figure of the same report.

    Attributes:
        text: Text of the cell.
        to: Name of the figure.
    """

    text: str
    to: str


@dataclass(frozen=True, kw_only=True)
class PageLink:
    """A cell that leads to a page beside the report.

    Attributes:
        text: Text of the cell.
        path: Path of the page, from the folder of the report; `/` between folders.
    """

    text: str
    path: str


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table.

    Attributes:
        header: (k,) names of the columns; all empty: no header is shown.
        rows: Rows of k cells each: text, numbers, `Link`, `PageLink` or None.
        caption: Shown above it; empty: none.
        total: The last row sums up the others.

    Raises:
        ValueError: A row has not as many cells as the header.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[object]]
    caption: str = ""
    total: bool = False

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.header):
                raise ValueError(f"a row of {len(row)} cells under a header of {len(self.header)}: {row}")

    def kinds(self) -> list[Kind]:
        """The kind of each column: numbers (or dashes) throughout, words, or prose that needs wrapping."""
        return [_kind([cell_text(row[k]) for row in self.rows]) for k in range(len(self.header))]


def cell_text(cell: object) -> str:
    """A cell as plain text; a dash for None."""
    if isinstance(cell, Link | PageLink):
        return cell.text
    return "–" if cell is None else printable(str(cell))


def report_console() -> Console:
    """A console on standard output, wide where that is no terminal."""
    console = Console()
    return console if console.is_terminal else Console(width=_PIPE_WIDTH)


def print_table(table: Table, console: Console | None = None) -> None:
    """Print one table without its caption; `rich.text.Text` in a cell keeps its style.

    On a terminal that is too narrow for the numbers they are wrapped, too; where even the words do not fit,
    each row becomes a list of its cells. Nothing is cut.

    Args:
        table: The table.
        console: Console to print on; None: `report_console`.
    """
    console = console or report_console()
    if not console.is_terminal:
        with console.capture() as capture:
            console.print(_console_table(table, whole_numbers=True))
        console.print(Text("\n".join(line.rstrip() for line in capture.get().splitlines())), soft_wrap=True)
    elif _width(table, whole_numbers=False) > console.width:
        for row in table.rows:
            _print_list(table.header, row, console)
    else:
        whole = _width(table, whole_numbers=True) <= console.width
        console.print(_console_table(table, whole_numbers=whole))


def _width(table: Table, *, whole_numbers: bool) -> int:
    """Characters that a table needs so that no word, or no number with its unit, is broken."""
    widths = []
    for k, kind in enumerate(table.kinds()):
        texts = [table.header[k], *(cell_text(row[k]) for row in table.rows)]
        if not (whole_numbers and kind == "number"):
            # The end of prose, often a path or a list, may be broken anywhere.
            texts = [word[:_LONG_WORD] for text in texts for word in text.split()]
        widths.append(max(map(len, texts), default=0))
    return sum(widths) + _BETWEEN * (len(widths) - 1)


def _print_list(header: Sequence[str], row: Sequence[object], console: Console) -> None:
    """The first cell in bold, and below it a line for each of the others that is not empty."""
    shown = [cell if isinstance(cell, Text) else Text(cell_text(cell)) for cell in row]
    console.print(Text(shown[0].plain, style="bold"))
    for name, cell in zip(header[1:], shown[1:], strict=True):
        if cell.plain:
            console.print(Padding(Text.assemble(f"{name}: " if name else "", cell), (0, 0, 0, 2)))


def _console_table(table: Table, *, whole_numbers: bool) -> ConsoleTable:
    rows = [[cell if isinstance(cell, Text) else Text(cell_text(cell)) for cell in row] for row in table.rows]
    last = rows.pop() if table.total and rows else None
    shown = ConsoleTable(
        box=box.SIMPLE, pad_edge=False, show_edge=False, show_header=any(table.header),
        show_footer=last is not None,
    )  # fmt: skip
    for k, (name, kind) in enumerate(zip(table.header, table.kinds(), strict=True)):
        shown.add_column(
            Text(name),
            last[k] if last is not None else "",
            justify="right" if kind == "number" else "left",
            overflow="fold",
            no_wrap=kind == "number" and whole_numbers,
        )
    for row in rows:
        shown.add_row(*row)
    return shown


def _kind(cells: Sequence[str]) -> Kind:
    if any(len(cell) > _LONG for cell in cells):
        return "prose"
    return "number" if all(_NUMBER.fullmatch(cell) for cell in cells) else "word"
