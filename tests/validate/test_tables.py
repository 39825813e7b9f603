"""Tables of a stored validation, against a made-up record."""

from __future__ import annotations

import io
from pathlib import Path

from rich.console import Console

from mskgrasp.reports.console import print_sections
from mskgrasp.reports.html import write_html
from mskgrasp.reports.section import Section
from mskgrasp.validate.tables import choice_text, label_error_text, validation_sections
from tests.validate.made_record import record


def by_title(values: dict) -> dict[str, Section]:
    return {section.title: section for section in validation_sections(values)}


def test_a_validation_without_comparisons_has_checks_and_parts_alone():
    short = {name: record()[name] for name in ("closed_form", "parts")}
    assert list(by_title(short)) == [
        "Closed-form physics",
        "1 parts in the physics engine against their meshes",
    ]


def test_checks_that_fail_are_marked():
    (table,) = by_title(record())["Closed-form physics"].tables
    assert [row[:2] for row in table.rows] == [("ok", "fall"), ("FAILED", "way")]
    assert table.rows[1][3:] == ("0.03", "0.04", "0.0285 .. 0.0315", "m")


def test_a_check_that_no_tried_value_meets_has_a_dash():
    values = record()
    beyond = dict(values["closed_form"][1], measured=None)
    (table,) = by_title(record(closed_form=[beyond]))["Closed-form physics"].tables
    assert table.rows[0][:5] == ("FAILED", "way", "v^2 / (2 mu g)", "0.03", None)


def test_a_part_that_differs_from_its_mesh_is_named():
    values = record()
    bad = dict(values["parts"][0], part="bolt", mass_error=0.1, passed=False)
    section = by_title(record(parts=[*values["parts"], bad]))[
        "2 parts in the physics engine against their meshes"
    ]
    assert len(section.text) == 1 and section.text[0].startswith("bolt differs from its mesh")
    assert ("relative error of the engine's mass", "1.0e-01") in section.tables[0].rows


def test_settings_are_compared_in_millimetres_degrees_and_points():
    (table,) = by_title(record())["Settings against 2000 Hz, 100 it"].tables
    first, second, unknown = table.rows
    assert first[0] == "1000 Hz, 50 it (production)" and first[1:3] == (620, "42.0%")
    assert first[3:8] == ("98.0%", "0.040", "1.20", "0.057", "5.73")
    assert first[8:] == ("0.01 (-0.02 .. 0.05)", "-0.20 (-1.00 .. 0.60)", "yes", "80")
    assert second[-2:] == ("not shown", "30")
    assert unknown[2:10] == (None,) * 8  # what nothing was measured of is a dash, not zero


def test_the_choice_says_whether_equivalence_was_shown_and_why_production_fails():
    assert choice_text(record()) == (
        "The cheapest setting that, with all finer ones, is equivalent within 0.25 mm and 2 points of "
        "success is 1000 Hz, 50 it. Production, 1000 Hz, 50 it: equivalent."
    )
    failing = {"setting": "500 Hz, 8 it", "shown": False, "production_fails": ["success rate: +3", "x"]}
    text = choice_text(record(choice=failing))
    assert text.startswith("No setting is shown to be equivalent within 0.25 mm and 2 points of success; ")
    assert text.endswith("is 500 Hz, 8 it. Production, 1000 Hz, 50 it: success rate: +3; x.")


def test_a_group_of_variants_is_named_once():
    (table,) = by_title(record())["Sensitivity: differences to production"].tables
    assert [row[:2] for row in table.rows] == [
        ("the displacement itself", ""), ("friction", "0.3"), ("", "0.8"), ("hulls", "exact"),
    ]  # fmt: skip
    assert table.rows[0][6:] == ("3.00", "9.00", "2.86", "17.19")


def test_the_error_of_a_label_is_a_sentence_and_absent_without_ranges():
    assert label_error_text(record()) == (
        "With the hand and the table drawn from their ranges, a label differs by 0.04 mm and 0.06 degrees "
        "(median), 1.20 mm and 5.73 degrees (90 %); success agrees in 98.0% (620 grasps)."
    )
    (table,) = by_title(record())["Error of a label"].tables
    assert table.rows == [("finger_force", "20", "40")]
    assert "Error of a label" not in by_title(record(label_error=None))
    nothing = record()["label_error"] | dict.fromkeys(
        ("shift_median", "turn_median", "shift_p90", "turn_p90")
    )
    text = label_error_text(record(label_error=nothing))
    assert text.startswith("No grasp lifts the part both as it is and with hand and table drawn (")


def test_attempts_that_are_no_labels_are_counted_by_reason():
    (text,) = by_title(record())["Attempts that are no labels"].text
    assert "Of 620 attempts" in text and ": 3 unsettled, 1 too_fast." in text and "penetrated" not in text
    assert "0.20 mm" in text and "0.40 m/s" in text and "40.0 mm" in text


def test_the_sections_fit_a_console_and_a_page(tmp_path: Path):
    stream = io.StringIO()
    print_sections(validation_sections(record()), Console(file=stream, width=300))
    assert stream.getvalue().count("FAILED") == 1 and "None" not in stream.getvalue()
    write_html(
        tmp_path / "page.html", title="Validation", conclusion="x", sections=validation_sections(record())
    )
    assert (tmp_path / "page.html").read_text().count("<table") == 6
