"""Sections of a report: text, tables and figures, ready for the console and for a page."""

from __future__ import annotations

import importlib.metadata
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from mskgrasp.core.version import __version__
from mskgrasp.runtime.console_table import Table

_PACKAGES = ("torch", "sapien", "mani_skill", "mujoco", "numpy", "opencv-python-headless")


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
class View:
    """An interactive view of a report; neither on the console nor on paper.

    Attributes:
        page: A whole page that needs nothing but itself, and may hold scripts. It is shown in a frame that
            cannot reach the report.
        caption: Shown below it.
    """

    page: str
    caption: str


@dataclass(frozen=True, kw_only=True)
class Section:
    """A titled section of a report: text, then tables, then figures and views.

    Attributes:
        title: Its heading.
        text: Paragraphs, plain text.
        tables: Below the text.
        figures: Below the tables.
        views: Below the figures.
        page_only: Too long for the console.
    """

    title: str
    text: Sequence[str] = ()
    tables: Sequence[Table] = ()
    figures: Sequence[Figure] = ()
    views: Sequence[View] = ()
    page_only: bool = False

    def __bool__(self) -> bool:
        return bool(self.text or self.tables or self.figures or self.views)


def settings_section(settings: Mapping[str, object], versions: Mapping[str, object] | None = None) -> Section:
    """A section with a run's settings and software versions, by default those of this process."""
    if versions is None:
        versions = {"mskgrasp": __version__, "python": platform.python_version()}
        versions |= {name: importlib.metadata.version(name) for name in _PACKAGES if _installed(name)}
    return Section(
        title="Settings and versions",
        tables=[
            Table(header=("setting", "value"), rows=list(_flat(settings).items())),
            Table(header=("package", "version"), rows=list(_flat(versions).items())),
        ],
        page_only=True,
    )


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
