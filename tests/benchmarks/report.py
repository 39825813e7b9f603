"""Tables of a benchmark, printed and stored."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from mskgrasp.runtime.console_table import Table, print_table


def show(tables: Sequence[Table], out: Path | None) -> None:
    """Prints tables and, where a folder is given, writes them to its ``report.json``."""
    for table in tables:
        print_table(table)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        values = dict(tables=[dict(header=one.header, rows=one.rows) for one in tables])
        (out / "report.json").write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")
