"""The page and its panels."""

from __future__ import annotations

import html

import pytest
from markdown_it import MarkdownIt

from mskgrasp.core.errors import NoPartFound
from mskgrasp.view.page import Page, Panel, plain
from tests.view.conftest import has_node, work


class Counting(Panel):
    times = 0

    def shown(self) -> None:
        self.times += 1


def test_one_panel_with_its_nodes_is_shown_at_a_time(page: Page):
    first, second = Counting(page, "first"), Counting(page, "second")
    page.begin()
    assert [first.folder.visible, first.root.visible, second.folder.visible, second.root.visible] == [
        True, True, False, False,
    ]  # fmt: skip
    page.show("second")
    assert [first.folder.visible, first.root.visible, second.folder.visible, second.root.visible] == [
        False, False, True, True,
    ]  # fmt: skip
    assert (first.times, second.times) == (1, 1) and has_node(page, "/second")


def test_a_first_panel_that_cannot_be_drawn_leaves_the_others(page: Page):
    class Failing(Panel):
        def shown(self) -> None:
            raise NoPartFound("nothing lies on the table")

    Failing(page, "first")
    second = Counting(page, "second")
    page.begin()
    assert "nothing lies on the table" in page.said
    page.show("second")
    assert second.times == 1 and second.folder.visible


def test_an_error_is_shown_on_the_page_and_printed(page: Page, capsys):
    def fail() -> None:
        raise NoPartFound("nothing lies on the table")

    page.main.submit("fail", fail)
    work(page)
    assert page.said == "**NoPartFound**: nothing lies on the table"
    assert capsys.readouterr().err == "mskgrasp.view: nothing lies on the table\n"


@pytest.mark.parametrize(
    "text",
    ['missed<iframe srcdoc="x">', "bracket <rev B>.stl", "*a* _b_ `c` &lt; \\<b> [d](javascript:e) # f"],
)
def test_text_of_files_is_shown_as_it_is(text: str):
    """The parser is of the same standard as the page's, and passes tags on, too."""
    assert html.unescape(MarkdownIt("commonmark").render(plain(text))) == f"<p>{text}</p>\n"
    assert "<iframe" in MarkdownIt("commonmark").render("<iframe>")


def test_a_control_hands_its_work_to_the_main_thread(page: Page):
    panel, done = Panel(page, "one"), []
    with panel.folder:
        box, button = page.gui.add_checkbox("box", False), page.gui.add_button("go")
    panel.on(box, lambda: done.append(box.value))
    panel.on(button, lambda: done.append("pressed"))
    box.value = True
    button.value = True
    assert done == []
    work(page)
    assert done == [True, "pressed"]
