"""Sections on the console: what is shown, in which order, and as it was written."""

from __future__ import annotations

import io
from pathlib import Path

from rich.console import Console

from mskgrasp.reports.console import print_sections
from mskgrasp.reports.section import Figure, Section
from mskgrasp.runtime.console_table import Table

TABLE = Table(header=("part", "n"), rows=[("nut", 3)], caption="By part")


def printed(*sections: Section) -> list[str]:
    stream = io.StringIO()
    print_sections(sections, Console(file=stream, width=60))
    return stream.getvalue().splitlines()


def test_a_section_is_its_title_its_text_and_its_tables_in_this_order():
    lines = printed(Section(title="Parts", text=["First.", "Second."], tables=[TABLE]))
    assert [line for line in lines if line.strip(" ─━-")] == [
        "Parts", "First.", "Second.", "By part", "part   n", "nut    3",
    ]  # fmt: skip
    assert lines[0] == ""  # sections are apart


def test_long_and_empty_sections_and_figures_alone_are_left_out():
    figure = Figure(path=Path("nowhere.png"), caption="Not read")
    assert not printed(
        Section(title="Settings", tables=[TABLE], page_only=True),
        Section(title="Nothing"),
        Section(title="Figures", figures=[figure]),
    )
    assert "Parts" in printed(Section(title="Parts", text=["x"], figures=[figure]))


def test_brackets_are_text_and_no_markup():
    lines = printed(Section(title="[red]Title[/red]", text=["RMSE 1.2 [0.9, 1.4] and [/b]"]))
    assert lines[1:] == ["[red]Title[/red]", "RMSE 1.2 [0.9, 1.4] and [/b]"]


def test_paragraphs_are_not_wrapped_so_that_lines_can_be_searched_in_a_file():
    text = "word " * 40 + "end"
    assert printed(Section(title="Long", text=[text]))[-1] == text
