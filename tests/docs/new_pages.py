"""Pages of runs that were not recorded yet: made with the first record, since a page shows what is stored."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

INDEX = "README.md"


def add_to_page(name: str, page: Mapping[str, str], folder: Path) -> None:
    """Adds the block of a run to its page, unless it is there; a new page gets a row of the index.

    Args:
        name: Name of the run.
        page: Its entry in ``runs.yaml``: ``file`` and ``title`` of the page, ``measured`` for the index,
            ``heading`` of the run, and ``words`` between heading and figures, without figures of their own.
        folder: Folder of the pages and of the index.
    """
    path = folder / page["file"]
    if path.exists():
        text = path.read_text(encoding="utf-8")
    else:
        text = f"# Results: {page['title'].lower()}\n"
        _add_to_index(folder / INDEX, f"| [{page['title']}]({page['file']}) | {page['measured']} |")
    block = f"<!-- run: {name} -->"
    if block not in text:
        text += f"\n## {page['heading']}\n\n{page['words'].strip()}\n\n{block}\n<!-- end -->\n"
        path.write_text(text, encoding="utf-8")


def _add_to_index(index: Path, row: str) -> None:
    """Adds a row after the last of the first table."""
    text = index.read_text(encoding="utf-8")
    table = re.search(r"(^\|.*\n)+", text, flags=re.M)
    if table is None:
        raise ValueError(f"{index} has no table of pages")
    index.write_text(text[: table.end()] + row + "\n" + text[table.end() :], encoding="utf-8")
