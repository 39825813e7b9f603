"""A report as one HTML file: text, tables and pictures, nothing fetched, no script; for screen and paper."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from pathlib import Path

from mskgrasp.core.files import write_whole
from mskgrasp.reports.section import Figure, Link, Section, Table, cell_text

_KINDS = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}
_PACKAGES = ("torch", "sapien", "mani_skill", "numpy", "opencv-python-headless")
_CLASSES = {"prose": ' class="t"', "number": ' class="n"', "word": ""}

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
    names = {figure.name for section in sections for figure in section.figures if figure.name}
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


def _section(section: Section, number: int, names: set[str]) -> str:
    lines = [f'<section id="section-{number}">', f"<h2>{escape(section.title)}</h2>"]
    lines += [f"<p>{escape(paragraph)}</p>" for paragraph in section.text]
    lines += [_table(table, names) for table in section.tables]
    lines += [_figure(figure) for figure in section.figures]
    return "\n".join([*lines, "</section>"])


def _table(table: Table, names: set[str]) -> str:
    attributes = [_CLASSES[kind] for kind in table.kinds()]
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


def _cell(cell: object, names: set[str]) -> str:
    if isinstance(cell, Link):
        if cell.to not in names:
            raise ValueError(f"link '{cell.text}' leads to picture '{cell.to}', which is not in the report")
        return f'<a href="#picture-{escape(cell.to)}">{escape(cell.text)}</a>'
    return escape(cell_text(cell))


def _figure(figure: Figure) -> str:
    content = figure.path.read_bytes()
    kind = next((kind for start, kind in _KINDS.items() if content.startswith(start)), None)
    if kind is None:
        raise ValueError(f"{figure.path} is neither PNG nor JPEG")
    data = base64.b64encode(content).decode()
    anchor = f' id="picture-{escape(figure.name)}"' if figure.name else ""
    caption = escape(figure.caption)
    return (
        f'<figure{anchor}><img src="data:{kind};base64,{data}" alt="{caption}">'
        f"<figcaption>{caption}</figcaption></figure>"
    )
