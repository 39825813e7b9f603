"""Tables of a benchmark, printed and stored."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from mskgrasp.core.files import write_whole
from mskgrasp.runtime.console_table import Table, cell_text, print_table

REPORT = "report.json"


def show(tables: Sequence[Table], out: Path | None, values: Mapping[str, Any] | None = None) -> None:
    """Prints tables and, where a folder is given, writes them to its ``report.json`` and ``report.md``.

    Args:
        tables: The tables; a caption becomes a heading.
        out: The folder.
        values: Further values of the report.
    """
    for table in tables:
        if table.caption:
            print(f"\n{table.caption}\n")
        print_table(table)
    if out is None:
        return
    out.mkdir(parents=True, exist_ok=True)
    stored = [
        (dict(title=one.caption) if one.caption else {}) | dict(header=one.header, rows=one.rows)
        for one in tables
    ]
    report = dict(tables=stored) | dict(values or {})
    write_whole(out / REPORT, (json.dumps(report, indent=1) + "\n").encode())
    lines = [line for table in tables for line in (*_heading(table), *markdown_rows(table), "")]
    write_whole(out / "report.md", "\n".join(lines).encode())


def _heading(table: Table) -> list[str]:
    return [f"## {table.caption}", ""] if table.caption else []


def markdown_rows(table: Table) -> Iterator[str]:
    """Lines of a table in Markdown, without its caption."""
    yield "| " + " | ".join(table.header) + " |"
    yield "|" + "".join("--:|" if kind == "number" else "---|" for kind in table.kinds())
    for row in table.rows:
        yield "| " + " | ".join(cell_text(cell).replace("|", "\\|") or " " for cell in row) + " |"
