"""Measured figures: each is on a results page, and says how it was made."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mskgrasp.core.config import read_yaml
from tests.docs.make_results import FACTS, REPORTS, RUNS, rendered
from tests.docs.pages import ROOT, without_code

RESULTS = sorted(set((ROOT / "docs/results").glob("*.md")) - {ROOT / "docs/results/README.md"})
NUMBER = r"(?<![\w.])\d+(?: \d{3})*(?:\.\d+)?(?![\w.])"


@pytest.mark.parametrize("page", RESULTS, ids=lambda page: page.stem)
def test_a_results_page_says_how_each_table_was_made(page: Path):
    text = page.read_text(encoding="utf-8")
    counts = {key: len(re.findall(rf"^\| {key} \|[^|]+\|$", text, flags=re.M)) for key in FACTS}
    assert counts["command"] >= 1
    assert len(set(counts.values())) == 1, counts


@pytest.mark.parametrize("page", RESULTS, ids=lambda page: page.stem)
def test_a_page_shows_what_its_stored_reports_say(page: Path):
    text = page.read_text(encoding="utf-8")
    assert rendered(text) == text, "run: python -m tests.docs.make_results"


@pytest.mark.parametrize("page", sorted((ROOT / "docs/results").glob("*.md")), ids=lambda page: page.stem)
def test_every_figure_of_a_page_comes_from_a_report(page: Path):
    words = re.sub(r"<!-- run: .*?<!-- end -->", "", page.read_text(encoding="utf-8"), flags=re.S)
    words = re.sub(r"^#.*$|\]\(.*?\)", "", without_code(words), flags=re.M)
    assert not re.findall(NUMBER, words)


def test_every_stored_report_is_on_a_page_and_every_run_has_one():
    stored = {path.stem for path in REPORTS.glob("*.json")}
    shown = {name for page in RESULTS for name in re.findall(r"<!-- run: (\w+) -->", page.read_text())}
    assert stored == shown >= set(read_yaml(RUNS))


def test_the_index_links_every_results_page():
    index = (ROOT / "docs/results/README.md").read_text(encoding="utf-8")
    assert not [page.name for page in RESULTS if f"]({page.name})" not in index]


def test_every_figure_of_the_readme_is_on_a_results_page():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    rows = readme[readme.index("| result |") : readme.index("[All results]")]
    known = {number for page in RESULTS for number in re.findall(NUMBER, page.read_text(encoding="utf-8"))}
    assert not [number for number in re.findall(NUMBER, rows) if number not in known]
