"""The report of a palletizing run: what it states, and its files."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from mskgrasp.palletize.config import PalletizeConfig
from mskgrasp.palletize.height_maps import write_height_maps
from mskgrasp.palletize.pallet_slots import Slot
from mskgrasp.palletize.placement_records import Placement
from mskgrasp.palletize.report import gain_lines, result_section, write_report
from mskgrasp.palletize.summary import summarise_placements
from tests.palletize.made_placements import placement, some
from tests.palletize.test_figures import bar


def test_the_table_has_a_row_for_each_correction_that_was_tried():
    lost = placement("d", 0, "none", None, reason="slipped")
    (table,) = result_section(summarise_placements([*some(), lost])).tables
    rows = [dict(zip(table.header, row, strict=True)) for row in table.rows]
    assert [row["correction"] for row in rows] == ["none", "predicted", "truth"]
    assert (rows[0]["placed"], rows[0]["measured"], rows[0]["not placed"]) == ("3 of 4", 3, "slipped 1")
    assert rows[0]["median error"] == "6.0 mm" and rows[0]["median turn error"] == "3.4 deg"
    assert rows[0]["95 % interval, mm"] == "4.0 - 20.0" and rows[1]["not placed"] == "-"


def test_the_gain_is_stated_with_its_interval_and_whether_the_goal_is_met():
    first, predicted, truth = gain_lines(summarise_placements(some()))
    assert first == "Medians are of 3 placements of 3 parts, those measured under every correction."
    assert predicted.startswith("Corrected by the prediction, the median error is 0.33 (0.10 - 0.50) of that")
    assert predicted.endswith("; the goal is 0.2 at most: not met.") and "goal" not in truth
    for error, judged in ((0.001, "met, but not by the whole interval"), (0.0005, "met")):
        good = [
            dataclasses.replace(one, translation_error=error) if one.correction == "predicted" else one
            for one in some()
        ]
        assert gain_lines(summarise_placements(good))[1].endswith(f"the goal is 0.2 at most: {judged}.")
    two = gain_lines(summarise_placements([one for one in some() if one.part != "c"]))[1]
    assert two.endswith("the goal is 0.2 at most: not judged by 2 parts, 3 are needed.")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Placement]]:
    """A run's folder with pictures and height maps of hand-made placements, reported."""
    out = tmp_path_factory.mktemp("run")
    (out / "placements").mkdir()
    placements = [
        *some(),
        placement("<d>", 0, "predicted", None, reason="slipped"),
        placement("e", 0, "truth", None, placed=True, reason="", unmeasured="one found: ..."),
    ]
    for one in placements:
        write_height_maps(bar(), out / "placements" / f"{one.name}.npz")
        cv2.imwrite(str(out / "placements" / f"{one.name}.png"), np.full((20, 30, 3), 128, np.uint8))
    cv2.imwrite(str(out / "placements" / "pallet-000-none.png"), np.full((120, 120, 3), 90, np.uint8))
    slots = [Slot(x=0.5, y=0.0, theta=1.0)]
    write_report(PalletizeConfig(out=out), out, placements, slots)
    return out, placements


def test_the_files_hold_the_summary_and_every_figure(run: tuple[Path, list[Placement]]):
    out, placements = run
    stored = json.loads((out / "report.json").read_text())
    assert stored == json.loads(json.dumps(summarise_placements(placements).to_json()))
    assert stored["corrections"]["predicted"]["reasons"] == {"slipped": 1}
    assert {path.name for path in out.glob("*.png")} == {"errors.png", "placed.png", "pallet-000.png"}
    page = (out / "report.html").read_text()
    assert page.count("<img") == 3 + 3  # and the three placements under the prediction
    assert "10 of 11 placements succeeded; median error by correction: none 6.0 mm and 3.4 deg, pred" in page


def test_a_pallet_without_a_picture_is_named(tmp_path):
    (tmp_path / "placements").mkdir()
    slots = [Slot(x=0.5, y=0.0, theta=1.0)]
    done = [placement("a", 0, one, None, reason="slipped") for one in ("none", "predicted")]
    picture = tmp_path / "placements" / "pallet-000-none.png"
    cv2.imwrite(str(picture), np.full((120, 120, 3), 90, np.uint8))
    write_report(PalletizeConfig(out=tmp_path, slots=Path("slots.yaml")), tmp_path, done, slots)
    page = (tmp_path / "report.html").read_text()
    assert "No picture of pallet 1 (correction predicted): the run was stopped after the last" in page
    write_report(PalletizeConfig(out=tmp_path), tmp_path, done, slots)
    assert "No picture" not in (tmp_path / "report.html").read_text()


def test_the_worst_under_the_prediction_come_first_and_the_lost_with_their_reason(run):
    page = (run[0] / "report.html").read_text()
    worst = page[page.rindex("Worst placements") : page.rindex("Not placed or not measured")]
    order = [worst.index(f'"#figure-{name}-000-00-predicted"') for name in "bca"]  # 3, 2 and 1 mm
    assert order == sorted(order) and "none" not in worst
    lost = page[page.rindex("Not placed or not measured") :]
    assert "slipped" in lost and "not measured: one found: ..." in lost
    assert "&lt;d&gt;" in lost and "<d>" not in page


def test_a_run_without_a_measured_placement_is_reported_too(tmp_path: Path):
    lost = [placement("a", 0, "none", None)]
    summary = write_report(PalletizeConfig(out=tmp_path), tmp_path, lost, [Slot(x=0.5, y=0.0, theta=0.0)])
    assert summary.compared == 0
    page = (tmp_path / "report.html").read_text()
    assert "0 of 1 placements succeeded; no error was measured under every correction." in page
    assert "nan" not in (tmp_path / "report.json").read_text().lower()


def test_the_share_of_refused_placements_is_stated():
    refused = placement("b", 0, "none", None, reason="refused")
    text = result_section(summarise_placements([placement("a", 0, "none", 1.0), refused])).text
    assert "Refused, as no grasp was worth trying: 1 of 2 (50%)." in text
