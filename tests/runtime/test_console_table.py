"""Tables: their cells as text, the kinds of their columns, and how they are printed."""

from __future__ import annotations

import io
from collections import Counter

import pytest
from rich.console import Console
from rich.text import Text

from mskgrasp.runtime.console_table import Link, Table, cell_text, print_table


def printed(table: Table, *, terminal: bool = False, width: int = 80) -> list[str]:
    stream = io.StringIO()
    print_table(table, Console(file=stream, width=width, force_terminal=terminal, color_system=None))
    return stream.getvalue().splitlines()


def test_a_cell_is_its_text_a_links_text_or_a_dash():
    assert [cell_text(cell) for cell in ("a", 3, 0.5, None, "", Link(text="nut", to="x"))] == [
        "a", "3", "0.5", "–", "", "nut",
    ]  # fmt: skip


def test_columns_are_numbers_words_or_prose():
    rows = [("nut", "1.2 mm", -3, "-", "yes"), ("bolt", None, "+0.5", "", "x" * 41)]
    table = Table(header=("part", "error", "shift", "none", "remark"), rows=rows)
    assert table.kinds() == ["word", "number", "number", "number", "prose"]
    assert Table(header=("a", "b"), rows=[("3 of 5", "M8"), ("–", "12")]).kinds() == ["number", "word"]


@pytest.mark.parametrize("row", [("a",), ("a", 1, 2), ()])
def test_a_row_of_another_length_than_the_header_is_refused(row: tuple):
    with pytest.raises(ValueError, match=rf"a row of {len(row)} cells under a header of 2"):
        Table(header=("part", "n"), rows=[("nut", 1), row])


def test_numbers_end_in_one_column_and_words_start_in_one():
    lines = printed(Table(header=("part", "n"), rows=[("nut", 3), ("hex_bolt", 1200)]))
    assert lines[0] == "part          n"
    assert lines[-2:] == ["nut           3", "hex_bolt   1200"]
    assert all(line == line.rstrip() for line in lines)  # a file is compared without regard to width


def test_a_total_stands_below_a_rule():
    rows = [("nut", 1), ("bolt", 2), ("all", 3)]
    plain, summed = (printed(Table(header=("part", "n"), rows=rows, total=total)) for total in (False, True))
    assert len(summed) == len(plain) + 1 and summed[-1].split() == ["all", "3"]
    assert not summed[-2].strip(" ─━-") and plain[-2].split() == ["bolt", "2"]
    assert printed(Table(header=("part",), rows=[], total=True))[0] == "part"


def test_a_table_without_names_has_no_header():
    assert printed(Table(header=("", ""), rows=[("a", "b")])) == ["a   b"]


def test_a_row_is_one_line_in_a_file_and_is_wrapped_on_a_terminal(capsys: pytest.CaptureFixture[str]):
    table = Table(header=("part", "remark"), rows=[("nut", "word " * 60 + "end")])
    print_table(table)  # standard output is no terminal
    assert len(capsys.readouterr().out.splitlines()) == 3
    lines = printed(table, terminal=True, width=40)
    assert len(lines) > 6 and max(map(len, lines)) <= 40


WIDE = Table(
    header=("part", "lifted", "n", "shift", "remark"),
    rows=[(f"p_{k}", f"{k} of 2250 (81.3 %)", 1234567, "3.25 mm 4.5 deg", "a" * 70) for k in range(10)],
)


def letters(text: str) -> Counter[str]:
    return Counter(text.replace(" ", ""))


def test_where_numbers_do_not_fit_a_terminal_they_are_wrapped_and_not_cut():
    lines = printed(WIDE, terminal=True, width=60)
    assert max(map(len, lines)) <= 60 and len(lines) > 2 + 10 * 2
    assert letters("".join(lines[2:])) == letters("".join(str(cell) for row in WIDE.rows for cell in row))


def test_where_words_do_not_fit_a_terminal_each_row_is_a_list_of_its_cells():
    lines = printed(WIDE, terminal=True, width=30)
    assert max(map(len, lines)) <= 30
    names = "".join(f"{name}:" for name in WIDE.header[1:]) * len(WIDE.rows)
    assert letters("".join(lines)) == letters(names + "".join(str(cell) for row in WIDE.rows for cell in row))
    assert lines[0].rstrip() == "p_0" and "  n: 1234567" in [line.rstrip() for line in lines]


def test_text_of_users_is_no_markup_and_styled_text_keeps_its_style():
    rows = [("[bold]x[/bold]", Text("red", style="red"))]
    assert printed(Table(header=("[a]", "b"), rows=rows))[-1].split() == ["[bold]x[/bold]", "red"]
    stream = io.StringIO()
    console = Console(file=stream, force_terminal=True, color_system="standard")
    print_table(Table(header=("a", "b"), rows=rows), console)
    assert "\x1b[31mred" in stream.getvalue()
