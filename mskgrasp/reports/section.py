"""Sections of a report: text, tables and figures, ready for the console and for a page."""

from __future__ import annotations

import importlib.metadata
import platform
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import mskgrasp

Kind = Literal["number", "word", "prose"]
_PACKAGES = ("torch", "sapien", "mani_skill", "mujoco", "numpy", "opencv-python-headless")
_NUMBER = re.compile(r"[+\-−]?\d.*|[-–]?")
_LONG = 40
"""Characters; a column with a longer cell is wrapped."""


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
class Table:
    """A table.

    Attributes:
        header: (k,) names of the columns; all empty: no header is shown.
        rows: Of k cells each: text, numbers, `Link` or None.
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


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A picture of a report; the console leaves it out.

    Attributes:
        path: PNG or JPEG; read when the page is written.
        caption: Shown below it, and its text alternative.
        name: Target of a `Link`; empty: none.
    """

    path: Path
    caption: str
    name: str = ""


@dataclass(frozen=True, kw_only=True)
class Section:
    """A titled section of a report: text, then tables, then figures.

    Attributes:
        title: Its heading.
        text: Paragraphs, plain text.
        tables: Below the text.
        figures: Below the tables.
        page_only: Too long for the console.
    """

    title: str
    text: Sequence[str] = ()
    tables: Sequence[Table] = ()
    figures: Sequence[Figure] = ()
    page_only: bool = False

    def __bool__(self) -> bool:
        return bool(self.text or self.tables or self.figures)


def cell_text(cell: object) -> str:
    """A cell as plain text; a dash for None."""
    if isinstance(cell, Link):
        return cell.text
    return "–" if cell is None else str(cell)


def settings_section(settings: Mapping[str, object], versions: Mapping[str, object] | None = None) -> Section:
    """A section with a run's settings and software versions, by default those of this process."""
    if versions is None:
        versions = {"mskgrasp": mskgrasp.__version__, "python": platform.python_version()}
        versions |= {name: importlib.metadata.version(name) for name in _PACKAGES if _installed(name)}
    return Section(
        title="Settings and versions",
        tables=[
            Table(header=("setting", "value"), rows=list(_flat(settings).items())),
            Table(header=("package", "version"), rows=list(_flat(versions).items())),
        ],
        page_only=True,
    )


def _kind(cells: Sequence[str]) -> Kind:
    if any(len(cell) > _LONG for cell in cells):
        return "prose"
    return "number" if all(_NUMBER.fullmatch(cell) for cell in cells) else "word"


def _installed(name: str) -> bool:
    try:
        importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return False
    return True


def _flat(values: Mapping[str, object], prefix: str = "") -> dict[str, str]:
    found: dict[str, str] = {}
    for key, value in values.items():
        if isinstance(value, Mapping):
            found |= _flat(value, f"{prefix}{key}.")
        elif isinstance(value, list):
            found[prefix + key] = ", ".join(map(str, value))
        else:
            found[prefix + key] = "not set" if value is None else str(value)
    return found
