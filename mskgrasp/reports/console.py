"""Reports on the console."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.text import Text

from mskgrasp.reports.section import Section
from mskgrasp.runtime.console_table import print_table, report_console


def print_sections(sections: Sequence[Section], console: Console | None = None) -> None:
    """Print the text and the tables of the sections that are not for the page only.

    Args:
        sections: In their order; one without text and tables is left out.
        console: Console to print on; None: `report_console`.
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
            print_table(table, console)
