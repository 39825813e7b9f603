"""Index page of several assessed parts, the most precise first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mskgrasp.assess.config import Tolerance
from mskgrasp.assess.summary import Row
from mskgrasp.assess.trials import EXACT, NOISY
from mskgrasp.reports.html import write_html
from mskgrasp.reports.section import Section
from mskgrasp.runtime.console_table import PageLink, Table


@dataclass(frozen=True, kw_only=True)
class IndexEntry:
    """A part in the index.

    Attributes:
        name: Name of the part or its file.
        headline: Its result, or why it could not be assessed.
        rows: Summary of its trials; empty where there are none.
        folder: Folder of its report beside the index; None where there is none.
    """

    name: str
    headline: str
    rows: tuple[Row, ...]
    folder: str | None

    def share(self, condition: str) -> float | None:
        """Best share of attempts within the tolerance, corrected by the prediction; None without trials."""
        return max(
            (row.within["predicted"].value for row in self.rows if row.condition == condition), default=None
        )


def write_index(path: Path, entries: Sequence[IndexEntry], tolerance: Tolerance) -> None:
    """Write the index page; the name of a part leads to its report."""
    ranked = sorted(
        entries,
        key=lambda one: (not one.rows, *(-(one.share(name) or 0.0) for name in (EXACT, NOISY)), one.name),
    )
    rows = [
        (
            one.name if one.folder is None else PageLink(text=one.name, path=f"{one.folder}/report.html"),
            _percent(one.share(EXACT)),
            _percent(one.share(NOISY)),
            one.headline,
        )
        for one in ranked
    ]
    good = sum((one.share(EXACT) or 0.0) >= 0.95 for one in entries)
    write_html(
        path,
        title="Precision of parts",
        conclusion=f"{good} of {len(entries)} parts end within {tolerance} in at least 95 % of attempts, "
        "corrected by the prediction, with an exact camera.",
        sections=[
            Section(
                title=f"Parts: within {tolerance}",
                tables=[Table(header=("part", EXACT, NOISY, "verdict"), rows=rows)],
            )
        ],
    )


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{share:.0%}"
