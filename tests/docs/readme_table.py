"""The README's table of results, of the rows that the stored reports give.

`make results` writes it between ``<!-- results -->`` and ``<!-- end -->``.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from tests.docs.pages import ROOT
from tests.docs.readme_rows import ROWS, ReadmeRow
from tests.docs.stored_reports import REPORTS, StoredReport, page_of, read_stored

README = ROOT / "README.md"
FORMER = " (with the weights that shipped before)"
"""Mark of a row."""
SUPERSEDED = "Recorded before "
"""Beginning of a note in a stored record which names a change of the code since."""
HEADER = ("result", "split", "n", "interval", "command")
_BLOCK = re.compile(r"(<!-- results -->\n).*?(<!-- end -->)", re.S)


def rendered_readme(text: str) -> str:
    """The README with the table that the stored reports give."""
    return _BLOCK.sub(lambda found: found[1] + table() + found[2], text)


def table() -> str:
    """The model and the table, as Markdown."""
    model = read_stored("shipped_model").facts["model"]
    lines = [
        "",
        f"The model that ships was {model.removeprefix('shipped: ')}.",
        "",
        f"| {' | '.join(HEADER)} |",
        "|" + "---|" * len(HEADER),
    ]
    for name, rows in shown_rows():
        stored = read_stored(name)
        lines += [_line(row, stored) for row in rows(stored)]
    return "\n".join(lines) + "\n\n"


def shown_rows() -> list[tuple[str, Callable[[StoredReport], list[ReadmeRow]]]]:
    """The stored reports of `ROWS`, of each the run at full size or else the first that there is."""
    known = {path.stem for path in REPORTS.glob("*.json")}
    found = []
    for name, rows in ROWS:
        sizes = (f"{name}_full", name, f"{name}_list", f"{name}_certified", f"{name}_quick")
        found += [(one, rows) for one in sizes if one in known][:1]
    return found


def _line(row: ReadmeRow, stored: StoredReport) -> str:
    facts = stored.facts
    first = f"[{row.name}]({page_of(stored.name)}): {row.text}"
    if any(note.startswith(SUPERSEDED) for note in facts.get("notes", [])):
        first += "; recorded before a change that the page names"
    if stored.of_former_model:
        first += FORMER
    cells = (first, row.split or facts["split"], row.n or facts["n"], row.interval, facts["command"])
    return "| " + " | ".join(cells) + " |"
