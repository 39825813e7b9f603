"""Measured figures: each is on a results page, and says how it was made."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from mskgrasp.core.config import read_config
from mskgrasp.evaluate.config import EvaluateConfig
from tests.docs import stored_reports
from tests.docs.make_results import FACTS, rendered
from tests.docs.pages import ROOT, without_code
from tests.docs.stored_reports import REPORTS, StoredReport, known_runs, read_stored
from tests.docs.summary_rows import IN_README, ROWS, rows_of
from tests.docs.summary_table import FORMER, HEADER, INDEX, README, shown_rows, summary, with_summary
from tests.sim_in_the_loop.regression import shipped_weights

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
    words = re.sub(r"<!-- (run: |results ).*?<!-- end -->", "", page.read_text(encoding="utf-8"), flags=re.S)
    words = re.sub(r"^#.*$|\]\(.*?\)", "", without_code(words), flags=re.M)
    assert not re.findall(NUMBER, words)


@pytest.mark.parametrize(
    ("weights", "words"),
    [
        (shipped_weights(), "shipped ([card](../../mskgrasp/learning/pretrained/card.md))"),
        ("0123456789abcdef", "shipped before (weights `0123456789abcdef`)"),
    ],
)
def test_a_table_says_whether_the_model_that_ships_made_it(tmp_path: Path, monkeypatch, weights, words):
    stored = json.loads((REPORTS / "success.json").read_text())
    stored["record"]["weights"] = weights
    (tmp_path / "success.json").write_text(json.dumps(stored))
    monkeypatch.setattr(stored_reports, "REPORTS", tmp_path)
    stored = read_stored("success")
    assert stored.facts["model"] == words and stored.of_former_model == words.startswith("shipped before")


@pytest.mark.parametrize("page", [README, INDEX], ids=lambda page: page.parent.name)
def test_a_summary_marks_the_rows_of_weights_that_ship_no_more(page: Path):
    marked = {name for name, _ in shown_rows(page) if read_stored(name).of_former_model}
    rows = sum(len(rows(read_stored(name))) for name, rows in shown_rows(page) if name in marked)
    assert summary(page).count(FORMER) == rows


def test_every_stored_report_is_on_a_page_and_every_run_has_one():
    stored = {path.stem for path in REPORTS.glob("*.json")}
    shown = {name for page in RESULTS for name in re.findall(r"<!-- run: (\w+) -->", page.read_text())}
    assert stored == shown >= set(known_runs())


def test_the_index_links_every_results_page():
    index = INDEX.read_text(encoding="utf-8").partition("<!-- results -->")[0]
    assert not [page.name for page in RESULTS if f"]({page.name})" not in index]


@pytest.mark.parametrize("page", [README, INDEX], ids=lambda page: page.parent.name)
def test_a_summary_shows_what_the_stored_reports_say(page: Path):
    text = page.read_text(encoding="utf-8")
    assert with_summary(text, page) == text, "run make results"
    assert summary(page) in text


def test_every_use_of_test_parts_has_figures_for_the_log():
    for path in REPORTS.glob("*.json"):
        stored = read_stored(path.stem)
        if stored.facts["split"].startswith("test"):
            rows = rows_of(stored)
            assert rows and all(re.search(r"\d", row.text) for row in rows), path.stem
    noisy = rows_of(read_stored("success_kinect2_full"))[0].text
    assert "lifted" in noisy and "no sensor noise" not in noisy


def test_the_rows_of_the_readme_are_rows_of_the_index():
    assert set(IN_README) < {name for name, _ in ROWS}
    assert len(shown_rows(README)) == len(IN_README), "one is not recorded"
    cells = [{line.split(": ", 1)[1] for line in summary(page).splitlines() if "](" in line}
             for page in (README, INDEX)]  # fmt: skip
    assert cells[0] < cells[1]


def test_no_figure_beside_the_table_of_the_readme_is_typed_by_hand():
    section = README.read_text(encoding="utf-8").split("## Results\n")[1].split("\n## ")[0]
    words = re.sub(r"<!-- results -->.*?<!-- end -->|\]\(.*?\)", "", section, flags=re.S)
    assert re.findall(NUMBER, without_code(words)) == ["95"]  # the level of the intervals


def test_every_row_of_the_summary_has_split_n_interval_and_command():
    rows = [line.strip("| ").split(" | ") for line in summary(INDEX).splitlines() if line.startswith("| [")]
    assert len(rows) >= len(shown_rows(INDEX)) >= len(ROWS) - 1
    for row in rows:
        assert len(row) == len(HEADER) and all(row), row
        assert "not printed" not in row[3]
        assert re.search(r"\d .*\d|^none", row[3]), f"no interval: {row}"
        assert row[4].startswith("`"), row


def test_a_figure_of_a_stored_report_is_the_figure_of_the_readme():
    by_name = dict(ROWS)
    stored = read_stored("success")
    assert isinstance(stored.report, dict)
    changed = stored.report["overall"] | dict(success_rate=0.123, success_interval=[0.1, 0.2])
    report = stored.report | dict(overall=changed)
    (lifted, _) = by_name["success"](StoredReport(name="success", facts=stored.facts, report=report))
    assert lifted.text.startswith("12.3% lifted") and lifted.interval == "10.0 - 20.0 %"


def test_the_readme_states_the_share_placed_and_that_of_a_simple_planner():
    def row(planner: str, n: int) -> dict:
        share = dict(n=n, of=20, share=n / 20, interval=[0.1, 0.9])
        within = {column: [[share] * 3] * 5 for column in ("none", "predicted", "camera", "truth")}
        return dict(planner=planner, n_parts=4, lifted=share, within=within, reasons={}, wrong_pose=0)

    report = dict(rows=[row("centroid", 4), row("ours", 18)])
    (found,) = dict(ROWS)["benchmark"](StoredReport(name="benchmark", facts=dict(command=""), report=report))
    shares = "90.0% of all attempts corrected by the prediction, 90.0% without"
    assert found.text.startswith(f"{shares}, no sensor noise; centroid")
    noisy = StoredReport(name="benchmark", facts=dict(command="--noise kinect2"), report=report)
    assert dict(ROWS)["benchmark"](noisy)[0].text.startswith(f"{shares}; centroid")
    assert found.interval.count("10.0 - 90.0 %") == 3 and found.n == "20 attempts at 4 parts by each planner"
    stored = StoredReport(name="benchmark_mujoco", facts=dict(command=""), report=report)
    (other,) = dict(ROWS)["benchmark_mujoco"](stored)
    assert other.name == f"{found.name}, in MuJoCo" and other.text == found.text


def test_a_run_of_the_paper_s_size_has_a_command_that_its_configuration_fits():
    for name, run in known_runs().items():
        if "--config configs/evaluate" in run["command"]:
            path = ROOT / run["command"].split("--config ")[1].split()[0]
            assert name.startswith(read_config(EvaluateConfig, path).experiment) and "out" in run


def test_the_readme_states_the_stored_intervals_of_the_comparison_of_engines():
    whole = dict(agreement=0.9, shift_median=4e-4, shift_p90=3e-3, n=20, n_both=11)
    report = dict(
        engines={"all": whole, "sapien, starts moved by 0.1 mm": whole, "nut": whole, "bolt": whole},
        intervals=dict(agreement=[0.8, 0.95], shift_median=[3e-4, 6e-4], shift_p90=[2e-3, 5e-3]),
        failed=["success agrees in 90.0%, at least 95% is needed"],
    )
    (row,) = dict(ROWS)["engines"](StoredReport(name="engines", facts={}, report=report))
    assert row.interval == "80.0 - 95.0 %; 0.30 - 0.60 mm; 2.00 - 5.00 mm"
    assert row.n == "20 grasps of 2 parts, 11 lifted in both"
    assert row.text.endswith("; bound missed: success agrees in 90.0%, at least 95% is needed")
