"""A report as one HTML file: text, tables and pictures, nothing fetched, no script; for screen and paper."""

from __future__ import annotations

import base64
import importlib.metadata
import platform
import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from pydantic import BaseModel

import mskgrasp
from mskgrasp.core.files import write_whole

_KINDS = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}
_PACKAGES = ("torch", "sapien", "mani_skill", "numpy", "opencv-python-headless")
_NUMBER = re.compile(r"[+\-−]?\d.*|[-–]?")
_LONG = 40
"""Characters; a column with a longer cell is wrapped."""

# Nothing but what is in the file: a browser refuses the rest, whatever stands in a caption.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
_STYLE = """
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 62rem; padding: 1.2rem; color: #22252b; background: #fff;
  font: 16px/1.5 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; overflow-wrap: break-word; }
h1 { font-size: 1.6rem; line-height: 1.2; margin: 0.4rem 0 0.8rem; }
h2 { font-size: 1.2rem; margin: 2.2rem 0 0.6rem; padding-top: 0.6rem; border-top: 2px solid #e3e6ea; }
nav ul { list-style: none; margin: 0; padding: 0; display: flex; flex-wrap: wrap; gap: 0.2rem 1.1rem; }
a { color: #1f6feb; }
.wide { overflow-x: auto; margin: 0.8rem 0 1.2rem; }
table { border-collapse: collapse; font-size: 0.88rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; padding: 0 0 0.35rem; color: #5c626b; }
th, td { padding: 0.3rem 0.75rem 0.3rem 0; text-align: left; vertical-align: top; }
td { border-top: 1px solid #e3e6ea; white-space: nowrap; }
td.t { white-space: normal; min-width: 16rem; }
th { border-bottom: 1px solid #8b909a; }
.n { text-align: right; white-space: nowrap; }
figure { margin: 1rem 0 1.6rem; }
img { display: block; max-width: 100%; height: auto; }
figcaption { color: #5c626b; font-size: 0.9rem; margin-top: 0.3rem; }
@media print {
  body { max-width: none; padding: 0; font-size: 10.5pt; }
  nav { display: none; }
  .wide { overflow: visible; }
  td { white-space: normal; }
  figure, tr { break-inside: avoid; }
  h2 { break-after: avoid; }
  img { max-height: 22cm; }
  a { color: inherit; text-decoration: none; }
}
"""


@dataclass(frozen=True, kw_only=True)
class Link:
    """A cell that leads to a picture of the same report.

    Attributes:
        text: What is read.
        to: The picture's name.
    """

    text: str
    to: str


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table; a column of nothing but numbers (or dashes) stands to the right.

    Attributes:
        header: (k,) names of the columns.
        rows: Of k cells each; anything that `str` makes readable.
        caption: Stands above it; empty: none.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[object]]
    caption: str = ""


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A picture that goes into the report.

    Attributes:
        path: PNG or JPEG; read when the report is written.
        caption: Stands below it, and is read to those who do not see it.
        name: What a `Link` leads to; empty: nothing does.
    """

    path: Path
    caption: str
    name: str = ""


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of the report under a title of its own: text, then tables, then pictures.

    Attributes:
        title: Its heading; also in the list at the top.
        text: Paragraphs, plain text.
        tables: Below the text.
        pictures: Below the tables.
    """

    title: str
    text: Sequence[str] = ()
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()


def write_html(path: Path, *, title: str, sections: Sequence[Section]) -> None:
    """Writes a report as one file that needs no other.

    Whatever stands in titles, texts and cells is text, never markup.

    Args:
        path: The file, ``report.html``.
        title: Of the whole.
        sections: In their order.

    Raises:
        OSError: A picture cannot be read, or the file not be written.
        ValueError: A picture is neither PNG nor JPEG, a row has not as many cells as the header, or a link
            leads nowhere; the caller is wrong.
    """
    names = {picture.name for section in sections for picture in section.pictures if picture.name}
    listed = "".join(
        f'<li><a href="#section-{number}">{escape(section.title)}</a></li>'
        for number, section in enumerate(sections, 1)
    )
    body = "\n".join(_section(section, number, names) for number, section in enumerate(sections, 1))
    page = (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        # Else a browser asks the folder for favicon.ico.
        '<link rel="icon" href="data:,">\n'
        f"<title>{escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        f"<h1>{escape(title)}</h1>\n<nav><ul>{listed}</ul></nav>\n{body}\n</body>\n</html>\n"
    )
    write_whole(path, page.encode())


def settings_section(config: BaseModel) -> Section:
    """A section with a run's settings and the versions of what made it."""
    versions = {"mskgrasp": mskgrasp.__version__, "python": platform.python_version()}
    versions |= {name: importlib.metadata.version(name) for name in _PACKAGES if _installed(name)}
    return Section(
        title="Settings and versions",
        tables=[
            Table(header=("setting", "value"), rows=list(_flat(config.model_dump(mode="json")).items())),
            Table(header=("package", "version"), rows=list(versions.items())),
        ],
    )


def _installed(name: str) -> bool:
    try:
        importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return False
    return True


def _flat(values: dict[str, object], prefix: str = "") -> dict[str, str]:
    found: dict[str, str] = {}
    for key, value in values.items():
        if isinstance(value, dict):
            found |= _flat(value, f"{prefix}{key}.")
        elif isinstance(value, list):
            found[prefix + key] = ", ".join(map(str, value))
        else:
            found[prefix + key] = "not set" if value is None else str(value)
    return found


def _section(section: Section, number: int, names: set[str]) -> str:
    lines = [f'<section id="section-{number}">', f"<h2>{escape(section.title)}</h2>"]
    lines += [f"<p>{escape(paragraph)}</p>" for paragraph in section.text]
    lines += [_table(table, names) for table in section.tables]
    lines += [_figure(picture) for picture in section.pictures]
    return "\n".join([*lines, "</section>"])


def _table(table: Table, names: set[str]) -> str:
    for row in table.rows:
        if len(row) != len(table.header):
            raise ValueError(f"a row of {len(row)} cells under a header of {len(table.header)}: {row}")
    attributes = [_kind([_text(row[k]) for row in table.rows]) for k in range(len(table.header))]
    head = "".join(
        f'<th scope="col"{attribute}>{escape(name)}</th>'
        for name, attribute in zip(table.header, attributes, strict=True)
    )
    rows = "\n".join(
        "<tr>"
        + "".join(f"<td{a}>{_cell(cell, names)}</td>" for cell, a in zip(row, attributes, strict=True))
        + "</tr>"
        for row in table.rows
    )
    caption = f"<caption>{escape(table.caption)}</caption>" if table.caption else ""
    body = f"<thead><tr>{head}</tr></thead>\n<tbody>{rows}</tbody>"
    return f'<div class="wide"><table>{caption}{body}</table></div>'


def _kind(cells: Sequence[str]) -> str:
    """The attribute of a column's cells: numbers, long text, or neither."""
    if any(len(cell) > _LONG for cell in cells):
        return ' class="t"'
    return ' class="n"' if all(_NUMBER.fullmatch(cell) for cell in cells) else ""


def _text(cell: object) -> str:
    if isinstance(cell, Link):
        return cell.text
    return "–" if cell is None else str(cell)


def _cell(cell: object, names: set[str]) -> str:
    if isinstance(cell, Link):
        if cell.to not in names:
            raise ValueError(f"link '{cell.text}' leads to picture '{cell.to}', which is not in the report")
        return f'<a href="#picture-{escape(cell.to)}">{escape(cell.text)}</a>'
    return escape(_text(cell))


def _figure(picture: Picture) -> str:
    content = picture.path.read_bytes()
    kind = next((kind for start, kind in _KINDS.items() if content.startswith(start)), None)
    if kind is None:
        raise ValueError(f"{picture.path} is neither PNG nor JPEG")
    data = base64.b64encode(content).decode()
    anchor = f' id="picture-{escape(picture.name)}"' if picture.name else ""
    caption = escape(picture.caption)
    return (
        f'<figure{anchor}><img src="data:{kind};base64,{data}" alt="{caption}">'
        f"<figcaption>{caption}</figcaption></figure>"
    )
