"""The reference page is that of today's docstrings."""

from __future__ import annotations

from tests.docs.make_reference import PAGE, reference


def test_the_reference_is_current():
    assert PAGE.read_text(encoding="utf-8") == reference(), "run make reference"
