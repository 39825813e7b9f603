"""The report of an evaluation: its conclusion, tables and JSON, against hand-made trials."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.evaluate.comparison import compare_models
from mskgrasp.evaluate.experiments import CERTIFIED
from mskgrasp.evaluate.report import Report, conclusion, interval_text, report_sections
from mskgrasp.evaluate.summary import summarise_trials
from mskgrasp.reports.section import Section
from mskgrasp.runtime.console_table import Link
from mskgrasp.trials.trial import Prediction
from tests.evaluate.made_trials import NOTHING, Model, printed, report_of, trial


def by_title(report: Report) -> dict[str, Section]:
    return {section.title: section for section in report_sections(report, Path("out"))}


def test_the_conclusion_states_success_and_errors_with_their_units():
    summary = summarise_trials([trial(), trial(number=1, success=False, reason="missed", measured=None)])
    assert conclusion(summary) == (
        "50.0% of 2 trials lifted the part (95 % interval 9.5% - 90.5%); RMSE of the predicted "
        "displacement in the hand: 5.0 mm and 11.5 deg."
    )
    # A trial in which nothing was planned counts, too.
    nothing = summarise_trials([trial(), trial(number=1, **NOTHING)])
    assert conclusion(nothing).startswith("50.0% of 2 trials lifted the part")
    assert conclusion(summarise_trials([])) == "No grasp was tried."
    unmeasured = summarise_trials([trial(measured=None, unmeasured="no tracker: ...")])
    assert conclusion(unmeasured).endswith("; no displacement was measured.")


def test_the_conclusion_of_a_comparison_names_model_parts_and_policy():
    predictions = {"one": Prediction(mean=[0.0, 0.001, 0.0, -0.1], std=[0.01] * 4)}
    best = [trial(predictions=predictions), trial(part="b", predictions=predictions, measured=[0.0] * 4)]
    text = conclusion(compare_models(best, {"one": Model()}))
    assert text == (
        "RMSE of one (high quality): 3.0 mm and 0.0 deg on known parts, 1.0 mm and 5.7 deg on novel parts."
    )
    chosen = trial(policy="recentred", chosen_by="one", measured=[0.0, 0.001, 0.002, -0.1])
    assert conclusion(compare_models([*best, chosen], {"one": Model()})).startswith(
        "RMSE of one (low variance, recentred): "
    )
    simulated = trial(policy="certified", chosen_by=CERTIFIED, measured=[0.0, 0.001, 0.0, -0.1])
    text = conclusion(compare_models([*best, chosen, simulated], {"one": Model()}))
    assert text.startswith("RMSE with the CAD known (0 of 1 planned grasps are certified): ")
    assert conclusion(compare_models([], {"one": Model()})) == "No displacement was measured."


def test_families_are_listed_where_they_are_several_and_fewer_than_the_parts():
    some = [trial(part="a"), trial(part="b"), trial(part="c", family="bolt")]
    (table,) = by_title(report_of(summarise_trials(some)))["Families"].tables
    assert [row[0] for row in table.rows] == ["bolt", "nut"]
    of_one = [trial(part=name) for name in "abc"]
    apart = [trial(part=name, family=name) for name in "abc"]
    for trials in (of_one, apart):
        assert "Families" not in by_title(report_of(summarise_trials(trials)))


def test_every_part_has_a_row_and_all_together_the_last():
    trials = [trial(part="a"), trial(part="b", success=False, reason="slipped", measured=None)]
    (table,) = by_title(report_of(summarise_trials(trials)))["Parts"].tables
    assert table.total and [row[:2] for row in table.rows] == [
        ("a", "1 of 1"), ("b", "0 of 1"), ("all", "1 of 2"),
    ]  # fmt: skip
    assert table.rows[0][3:5] == ("5.0 mm", "4.0 mm") and table.rows[1][3:] == (
        "-",
        "-",
        "-",
        "-",
        "slipped 1",
    )
    assert "paper: 94.9% simulated, 86.3% real" in printed(summarise_trials(trials))


def test_the_worst_trials_lead_to_their_pictures():
    worst = {"worst/a-000.png": "a-000: lifted, moved far"}
    report = Report(summary=summarise_trials([trial()]), trials={}, worst=worst, settings={}, versions={})
    section = by_title(report)["Worst trials"]
    assert section.tables[0].rows == [(Link(text="a-000", to="a-000"), "lifted, moved far")]
    assert [(one.path, one.name) for one in section.figures] == [(Path("out/worst/a-000.png"), "a-000")]
    assert not by_title(report_of(summarise_trials([trial()])))["Worst trials"]


def test_tape_is_compared_with_the_truth_only_where_there_is_one():
    assert not by_title(report_of(summarise_trials([trial()])))["Measured by tape, against the truth"]
    taped = trial(measured=[0.0, 0.004, np.nan, -0.1], true=[0.0, 0.0043, 0.001, -0.1 + np.radians(0.5)])
    (table,) = by_title(report_of(summarise_trials([taped])))["Measured by tape, against the truth"].tables
    assert table.rows == [("flat", 1, "0.30 mm", "0.30 mm", "0.50 deg", "0.50 deg")]


def test_the_stored_report_is_strict_json_with_trials_in_words():
    taped = trial(measured=[0.0, 0.004, np.nan, -0.1], true=[0.0, 0.0043, 0.001, -0.1])
    report = Report(
        summary=summarise_trials([taped]),
        trials={"a-000": "lifted"},
        worst={"worst/a-000.png": "a-000: lifted"},
        settings={"seed": 0},
        versions={"simulation": "2"},
    )
    stored = json.loads(json.dumps(report.to_json(), allow_nan=False))
    assert stored["experiment"] == "success" and stored["overall"]["successes"] == 1
    assert stored["trials"] == [{"trial": "a-000", "outcome": "lifted"}]
    assert stored["worst"] == [["worst/a-000.png", "a-000: lifted"]]
    assert stored["tape_against_truth"]["flat"]["translation_rmse"] == pytest.approx(3e-4)
    assert stored["tape_against_truth"]["tilted"] == {"trials": 0}


def test_an_interval_of_a_share_is_a_range_of_percentages():
    assert interval_text((0.0949, 0.9051), digits=1) == "9.5% - 90.5%"
    assert interval_text((0.0, 1.0)) == "0% - 100%" and interval_text(None) == "-"


def test_the_share_of_refused_trials_is_stated_and_the_rate_without_them():
    refused = dict(NOTHING, reason="refused", quality=0.002)
    text = printed(summarise_trials([trial(), trial(number=1), trial(number=2, **refused)]))
    assert "66.7% lifted" in text
    assert "refused, as no grasp was worth trying: 1 of 3 (33%), counted as not lifted" in text
    assert "of the 2 grasps tried 100.0% lifted the part" in text
    assert "refused, as no grasp was worth trying: 0 of 1 (0%)\n" in printed(summarise_trials([trial()]))
