"""A report is one file that a browser shows without errors, whatever text it contains."""

from __future__ import annotations

import os
import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from mskgrasp.core import palette
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.reports.html import write_html
from mskgrasp.reports.section import Figure, Section, settings_section
from mskgrasp.runtime.console_table import Link, Table
from tests.browser import Page

HOSTILE = '<script>document.title="owned"</script> & "quoted" <img src=x onerror=alert(1)>'
COMMAND = f"python -m mskgrasp.evaluate --out '{HOSTILE}'"


def picture(path: Path, width: int = 40) -> Path:
    cv2.imwrite(str(path), np.full((20, width, 3), 128, np.uint8))
    return path


@pytest.fixture
def report(tmp_path: Path) -> Path:
    path = tmp_path / "report.html"
    sections = [
        Section(
            title=f"First {HOSTILE}",
            text=["A paragraph.", HOSTILE],
            tables=[
                Table(
                    header=("part", "error", HOSTILE),
                    rows=[
                        ("nut", "1.2 mm", Link(text=HOSTILE, to="worst")),
                        ("bolt", None, HOSTILE),
                        *[
                            (f"part_{k}", "12 mm", "a rather long remark about this row " * 3)
                            for k in range(4)
                        ],
                    ],
                    caption=HOSTILE,
                )
            ],
        ),
        Section(
            title="Pictures",
            figures=[
                Figure(path=picture(tmp_path / "a.png", 1725), caption=HOSTILE, name="worst"),
                Figure(path=picture(tmp_path / "b.jpg"), caption="A JPEG"),
            ],
        ),
        settings_section(PlannerConfig().model_dump()),
    ]
    write_html(path, title=f"Report {HOSTILE}", conclusion=HOSTILE, sections=sections, command=COMMAND)
    for made in (tmp_path / "a.png", tmp_path / "b.jpg"):
        made.unlink()  # the file needs no other
    return path


def test_a_browser_shows_every_figure_without_errors(report):
    with Page(report) as page:
        widths = page.evaluate("[...document.images].map(i => i.complete ? i.naturalWidth : 0)")
        assert widths == [1725, 40]
        assert page.evaluate("document.title") == f"Report {HOSTILE}"
        assert page.evaluate("document.scripts.length") == 0
        assert page.evaluate("document.querySelector('section p + p').textContent") == HOSTILE
        assert page.evaluate("document.querySelector('header p').textContent") == HOSTILE
        assert page.evaluate("document.querySelector('header code').textContent") == COMMAND
        assert page.evaluate("document.querySelectorAll('img, table').length") == 5
        assert page.evaluate("[...document.links].every(a => document.querySelector(a.hash) !== null)")
        assert page.evaluate("getComputedStyle(document.querySelector('td.number')).textAlign") == "right"
        assert page.complaints == []


def test_errors_of_a_page_are_reported(tmp_path):
    """The test above would pass with a browser that reports nothing."""
    path = tmp_path / "bad.html"
    path.write_text('<script>console.error("oh")</script><img src="missing.png"><p>')
    with Page(path) as page:
        assert page.evaluate("[...document.images].map(i => i.naturalWidth)") == [0]
        assert any("oh" in text for text in page.complaints)
        assert any("missing.png" in text for text in page.complaints)


def test_it_fits_a_phone(report):
    with Page(report, width=390) as page:
        assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        table, caption = page.evaluate(
            "['table', 'caption span'].map(a => document.querySelector(a).getBoundingClientRect().right)"
        )
        assert caption < 390 < table  # which scrolls, its caption does not


def test_a_reader_who_prefers_the_dark_sees_a_dark_page(report):
    def colours(page: Page, of: str) -> list[int]:
        return [int(one) for one in re.findall(r"\d+", page.evaluate(of))[:3]]

    with Page(report) as page:
        for scheme, paper, ink in (
            ("light", "#ffffff", palette.INK),
            ("dark", palette.DARK["PAPER"], palette.DARK["INK"]),
        ):
            page.prefer(scheme)
            style = "getComputedStyle(document.body)"
            assert colours(page, f"{style}.backgroundColor") == list(bytes.fromhex(paper[1:]))
            assert colours(page, f"{style}.color") == list(bytes.fromhex(ink[1:]))


def test_what_cannot_be_shown_is_refused(tmp_path):
    def write(**section: object) -> None:
        write_html(tmp_path / "r.html", title="t", conclusion="c", sections=[Section(title="s", **section)])  # type: ignore[arg-type]

    (tmp_path / "drawing.svg").write_text("<svg onload='alert(1)'/>")
    with pytest.raises(ValueError, match="neither PNG nor JPEG"):
        write(figures=[Figure(path=tmp_path / "drawing.svg", caption="")])
    with pytest.raises(FileNotFoundError):
        write(figures=[Figure(path=tmp_path / "gone.png", caption="")])
    with pytest.raises(ValueError, match="1 cells under a header of 2"):
        write(tables=[Table(header=("a", "b"), rows=[("x",)])])
    with pytest.raises(ValueError, match="'nowhere', which is not in the report"):
        write(tables=[Table(header=("a",), rows=[(Link(text="x", to="nowhere"),)])])
    assert not (tmp_path / "r.html").exists()


def test_a_command_with_a_file_name_that_is_not_utf_8_is_shown(tmp_path):
    command = "python -m mskgrasp.assess " + os.fsdecode(b"geh\xe4use.stl")
    write_html(tmp_path / "report.html", title="A", conclusion="B", sections=[], command=command)
    assert r"mskgrasp.assess geh\udce4use.stl" in (tmp_path / "report.html").read_text(encoding="utf-8")
