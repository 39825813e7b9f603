"""Measured figures: each is on a results page, and says how it was made."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.docs import make_results
from tests.docs.pages import ROOT

RESULTS = sorted(set((ROOT / "docs/results").glob("*.md")) - {ROOT / "docs/results/README.md"})
KEYS = ("command", "split", "n", "intervals", "model", "simulation", "recorded", "machine")
NUMBER = r"(?<![\w.])\d+(?: \d{3})*(?:\.\d+)?(?![\w.])"


@pytest.mark.parametrize("page", RESULTS, ids=lambda page: page.stem)
def test_a_results_page_says_how_each_table_was_made(page: Path):
    text = page.read_text(encoding="utf-8")
    counts = {key: len(re.findall(rf"^\| {key} \|[^|]+\|$", text, flags=re.M)) for key in KEYS}
    assert counts["command"] >= 1
    assert len(set(counts.values())) == 1, counts


def test_the_index_links_every_results_page():
    index = (ROOT / "docs/results/README.md").read_text(encoding="utf-8")
    assert not [page.name for page in RESULTS if f"]({page.name})" not in index]


def test_every_figure_of_the_readme_is_on_a_results_page():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    rows = readme[readme.index("| result |") : readme.index("[All results]")]
    known = {number for page in RESULTS for number in re.findall(NUMBER, page.read_text(encoding="utf-8"))}
    assert not [number for number in re.findall(NUMBER, rows) if number not in known]


def test_the_page_on_validation_is_that_of_the_stored_report():
    """Run `make results` after storing a report or changing a table."""
    record = make_results.report()
    assert make_results.PAGE.read_text(encoding="utf-8") == make_results.page(record)
    readme = make_results.README.read_text(encoding="utf-8")
    assert readme.count("| `mskgrasp.validate` |") == 1
    assert readme == make_results.with_row(readme, record)


def test_a_stored_report_names_neither_folders_nor_a_machine_s_processes():
    record = make_results.report()
    assert "/tmp" not in make_results.REPORT.read_text(encoding="utf-8")
    assert not {"out", "workers"} & record["settings"].keys()
