"""The summary of results, of the rows that the stored reports give.

`make results` writes it between ``<!-- results -->`` and ``<!-- end -->``: all rows into the index of the
results, the main ones into the README.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable
from pathlib import Path

from tests.docs.pages import ROOT
from tests.docs.stored_reports import REPORTS, RESULTS, StoredReport, page_of, read_stored
from tests.docs.summary_rows import IN_README, ROWS, SummaryRow

README = ROOT / "README.md"
INDEX = RESULTS / "README.md"
FORMER = " (with the weights that shipped before)"
"""Mark of a row."""
WILSON = " (share by Wilson's, too narrow where parts are alike)"
"""Mark of an interval that was recorded before those of docs/results/intervals.md."""
SUPERSEDED = "Recorded before "
"""Beginning of a note in a stored record which names a change of the code since."""
HEADER = ("result", "split", "n", "interval", "command")
_BLOCK = re.compile(r"(<!-- results -->\n).*?(<!-- end -->)", re.S)


def with_summary(text: str, page: Path) -> str:
    """The text of the README or of the index with the rows that the stored reports give."""
    return _BLOCK.sub(lambda found: found[1] + summary(page) + found[2], text)


def summary(page: Path) -> str:
    """The model and the table of the README or of the index, as Markdown."""
    model = read_stored("shipped_model").facts["model"]
    lines = [
        "",
        f"The model that ships was {model.removeprefix('shipped: ')}.",
        "",
        f"| {' | '.join(HEADER)} |",
        "|" + "---|" * len(HEADER),
    ]
    for name, rows in shown_rows(page):
        stored = read_stored(name)
        to = posixpath.relpath(page_of(name), page.parent.relative_to(ROOT).as_posix())
        lines += [_line(row, stored, to) for row in rows(stored)]
    return "\n".join(lines) + "\n\n"


def shown_rows(page: Path) -> list[tuple[str, Callable[[StoredReport], list[SummaryRow]]]]:
    """The stored reports of a page's rows, of each the run at full size or else the first that there is."""
    known = {path.stem for path in REPORTS.glob("*.json")}
    found = []
    for name, rows in ROWS:
        if page == README and name not in IN_README:
            continue
        sizes = [f"{name}_full", name]
        if name == "benchmark":
            sizes += [f"{name}_{size}" for size in ("list", "certified", "quick")]
        found += [(one, rows) for one in sizes if one in known][:1]
    return found


def _line(row: SummaryRow, stored: StoredReport, page: str) -> str:
    facts = stored.facts
    first = f"[{row.name}]({page}): {row.text}"
    if any(note.startswith(SUPERSEDED) for note in facts.get("notes", [])):
        first += "; recorded before a later change (see its page)"
    if stored.of_former_model:
        first += FORMER
    interval = row.interval + WILSON * facts["intervals"].startswith("95 %: Wilson")
    cells = (first, row.split or facts["split"], row.n or facts["n"], interval, facts["command"])
    return "| " + " | ".join(cells) + " |"
