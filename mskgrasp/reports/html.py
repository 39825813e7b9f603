"""Reports as one HTML file without references to other files; only interactive views hold scripts."""

from __future__ import annotations

import base64
import shlex
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from mskgrasp.core import palette
from mskgrasp.core.files import write_whole
from mskgrasp.reports.section import Figure, Section
from mskgrasp.runtime.console_table import Link, PageLink, cell_text

_TEMPLATE = "report.html.j2"
_KINDS = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}


def write_html(
    path: Path, *, title: str, conclusion: str, sections: Sequence[Section], command: str | None = None
) -> None:
    """Write a report as one file, with the date and the command under the conclusion.

    Titles, texts and cells are text, never markup.

    Args:
        path: The file, ``report.html``.
        title: Title of the report.
        conclusion: Its result in one sentence.
        sections: In their order; empty ones are left out.
        command: The command that made it; None: that of this process.

    Raises:
        OSError: A figure cannot be read, or the file cannot be written.
        ValueError: A figure is neither PNG nor JPEG, or a link has no figure.
    """
    sections = [section for section in sections if section]
    _check_links(sections)
    environment = Environment(
        loader=PackageLoader("mskgrasp.reports"), autoescape=True, undefined=StrictUndefined
    )
    environment.filters |= {"cell_text": cell_text, "data_url": _data_url}
    environment.tests["link"] = lambda cell: isinstance(cell, Link)
    environment.tests["page_link"] = lambda cell: isinstance(cell, PageLink)
    page = environment.get_template(_TEMPLATE).render(
        title=title,
        conclusion=conclusion,
        sections=sections,
        scripts=any(section.views for section in sections),
        date=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
        command=shlex.join(["python", *sys.orig_argv[1:]]) if command is None else command,
        palette=palette,
    )
    # A file's name in the command need not be UTF-8.
    write_whole(path, page.encode(errors="backslashreplace") + b"\n")


def _check_links(sections: Sequence[Section]) -> None:
    names = {figure.name for section in sections for figure in section.figures if figure.name}
    rows = (row for section in sections for table in section.tables for row in table.rows)
    for cell in (cell for row in rows for cell in row):
        if isinstance(cell, Link) and cell.to not in names:
            raise ValueError(f"link '{cell.text}' leads to figure '{cell.to}', which is not in the report")


def _data_url(figure: Figure) -> str:
    content = figure.path.read_bytes()
    kind = next((kind for start, kind in _KINDS.items() if content.startswith(start)), None)
    if kind is None:
        raise ValueError(f"{figure.path} is neither PNG nor JPEG")
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
