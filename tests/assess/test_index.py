"""Index page of several parts."""

from __future__ import annotations

from mskgrasp.assess.config import parse_tolerance
from mskgrasp.assess.index import IndexEntry, write_index
from mskgrasp.assess.summary import summarise
from mskgrasp.core.grasp import TILT_LIMIT
from tests.assess.made_trials import failed, made
from tests.browser import Page

TOLERANCE = parse_tolerance("1mm,2deg")


def entry(name: str, trials) -> IndexEntry:
    rows = tuple(summarise(trials, TOLERANCE, TILT_LIMIT))
    return IndexEntry(name=name, headline="correct by the prediction", rows=rows, folder=name)


def test_the_most_precise_part_comes_first_and_one_without_a_report_last(tmp_path):
    broken = IndexEntry(name="broken.stl", headline="broken.stl: no triangles", rows=(), folder=None)
    good = entry("good", [made(number) for number in range(4)])
    poor = entry("poor", [made(0), failed(1), failed(2), failed(3)])
    never = entry("never", [failed(0)])  # no share at all is still more than no report
    write_index(tmp_path / "index.html", [broken, never, poor, good], TOLERANCE)
    with Page(tmp_path / "index.html") as page:
        names = page.evaluate(
            "[...document.querySelectorAll('tbody tr')].map(row => row.children[0].innerText)"
        )
        assert names == ["good", "poor", "never", "broken.stl"]
        pages = page.evaluate("[...document.querySelectorAll('td a')].map(a => a.getAttribute('href'))")
        assert pages == ["good/report.html", "poor/report.html", "never/report.html"]
        assert "1 of 4 parts" in page.evaluate("document.querySelector('.conclusion').innerText")
        assert page.complaints == []


def test_a_part_leads_to_its_report_whatever_its_folder_is_called(tmp_path):
    report = tmp_path / 'a: "b" #1 %2F' / "report.html"
    report.parent.mkdir()
    report.write_text("<title>its report</title>")
    one = entry(report.parent.name, [made(0)])
    write_index(tmp_path / "index.html", [one], TOLERANCE)
    with Page(tmp_path / "index.html") as page:
        address = page.evaluate("document.querySelector('td a').href")
    assert address == report.as_uri()
