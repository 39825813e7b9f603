"""Report of a benchmark: its line, its tables, and its numbers."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from mskgrasp.benchmark.part_list import BenchmarkPart
from mskgrasp.benchmark.report import RunFacts, conclusion, stored_sections, write_report
from mskgrasp.benchmark.summary import summarise
from tests.benchmark.made_trials import failed, made
from tests.browser import Page

PARTS = [
    BenchmarkPart(name="nut", family="nut", split="test", standard="ISO 4032"),
    BenchmarkPart(name="bracket", family="bracket", split="test", standard=""),
]


def facts_of(parts: list[BenchmarkPart]) -> RunFacts:
    return RunFacts(
        cell="sapien",
        noise="off",
        seed=0,
        parts=parts,
        trained_on={"ours": 1},
        chosen_by={"certified": 2},
        known_families={"ours": 2, "certified": 2},
        settings=dict(seed=0),
    )


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    out = tmp_path_factory.mktemp("report")
    trials = [
        *(made(number, part=part.name, quality=0.9) for part in PARTS for number in range(5)),
        *(made(number, "centroid", part=part.name, quality=None, expected=[0.0] * 4, placed=[0.0042, 0, 0])
          for part in PARTS for number in range(4)),
        *(failed(4, "centroid", part=part.name, quality=None) for part in PARTS),
    ]  # fmt: skip
    headline, sections = write_report(out, trials, facts_of(PARTS))
    return out, headline, {section.title: section for section in sections}


def test_the_first_line_names_the_planner_that_places_most(written):
    out, headline, _ = written
    assert headline.startswith(
        "Of all 10 attempts at 2 parts, ours places most within 1 mm and 2 degrees: 100% corrected by its "
        "prediction (95 % interval 46% to 100%), 0% without a correction"
    )
    assert json.loads((out / "report.json").read_text())["headline"] == headline


@pytest.mark.parametrize(
    ("trials", "said"),
    [
        ([made(0), failed(0, "centroid")], "1 parts, ours places most within 1 mm and 2 degrees: 100% corr"),
        ([made(0)], "1 parts, ours places within 1 mm and 2 degrees: 100% corrected"),
        ([made(0), made(0, "centroid")], "1 parts, ours and centroid each place 100% corrected by its"),
        ([failed(0), failed(0, "centroid")], "1 parts, no planner places any within 1 mm and 2 degrees"),
    ],
)
def test_a_winner_is_named_only_where_there_is_one(trials, said):
    assert said in conclusion(summarise(trials, 0), facts_of(PARTS[:1]))


@pytest.mark.parametrize("trials", [[made(0)], [made(0), made(0, "centroid")], [failed(0)]])
def test_the_noise_of_a_cells_file_is_named(trials, tmp_path):
    facts = replace(facts_of(PARTS[:1]), cell="my.yaml", noise="kinect2", settings=dict(noise=None))
    headline, sections = write_report(tmp_path, trials, facts)
    assert headline.endswith("in the cell my.yaml with kinect2 noise.")
    assert sections[0].text[0] == "In the cell my.yaml, whose depth images have kinect2 noise."
    assert ("noise", "kinect2") in sections[-1].tables[0].rows


def test_the_numbers_are_stored(written):
    out, _, _ = written
    values = json.loads((out / "report.json").read_text())
    ours, centroid = values["rows"]
    assert ours["within"]["predicted"][2][1]["n"] == 10 and centroid["lifted"]["n"] == 8
    assert centroid["reasons"] == {"slipped": 2}
    assert values["trained_on"] == {"ours": 1} and values["chosen_by"] == {"certified": 2}
    assert values["known_families"] == {"ours": 2, "certified": 2}
    assert values["parts"] == ["nut", "bracket"]
    assert {one["planner"] for one in values["refusals"]} == {"ours"}
    assert {one["part"] for one in values["budgets"]} == {"", "nut", "bracket"}


def test_the_tables_say_which_parts_can_be_bought_and_what_was_known(written):
    *_, sections = written
    (table,) = sections["Parts"].tables
    assert table.rows[0] == ("nut", "nut", "ISO 4032", "test", "5 of 5", "0 of 5")
    assert table.rows[1][2] == "-"
    first = sections["Placed within 1 mm and 2 degrees"]
    assert first.text[0].endswith(", whose depth images have no noise.")
    assert first.text[3:] == [
        "The networks of ours were trained on 1 of these parts.",
        "The networks of certified were chosen (early stopping) and calibrated by 2 of these parts.",
        "The networks of ours and certified were trained on other parts of the families of 2 of these parts.",
    ]
    (budget,) = sections["Error budget"].tables
    assert budget.rows[0][:3] == ("ours", 10, "0.50 mm, 0.00 deg")


def test_the_stored_numbers_give_the_same_tables(written):
    out, _, sections = written
    stored = stored_sections(json.loads((out / "report.json").read_text()))
    assert [one.title for one in stored] == [
        "Placed within 1 mm and 2 degrees", "Other tolerances", "Precision against refusals", "Error budget",
    ]  # fmt: skip
    for one in stored:
        assert one.tables == sections[one.title].tables and one.text == sections[one.title].text
        assert not one.page_only


def test_the_page_works_by_itself(written):
    out, headline, _ = written
    with Page(out / "report.html") as page:
        assert headline in page.evaluate("document.querySelector('.conclusion').textContent")
        assert page.complaints == []
