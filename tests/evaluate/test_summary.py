"""What trials amount to: against numbers worked out by hand."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from mskgrasp.evaluate.comparison import PAPER, compare, paper_label
from mskgrasp.evaluate.figures import draw_comparison, draw_errors, draw_success
from mskgrasp.evaluate.report import print_report, sections
from mskgrasp.evaluate.summary import farthest_off, summarise, worst_trials
from mskgrasp.trials.trial import Prediction, Trial


def trial(**changes: object) -> Trial:
    values = dict(
        part="a", number=0, seed=1, success=True, reason="", grasp=[0.5, 0.0, 0.02, 0.0], quality=0.9,
        point_base=[0.5, 0.01, 0.015],
        predicted=[0.003, 0.0, 0.0, 0.1], predicted_std=[0.001] * 4, measured=[0.0, 0.004, 0.0, -0.1],
        tilt=0.0, planning_s=1.0, family="nut", policy="quality",
    )  # fmt: skip
    return Trial(**(values | changes))  # type: ignore[arg-type]


NOTHING = dict(
    success=False, reason="NoPartFound", grasp=None, quality=None, predicted=None, predicted_std=None,
    measured=None, planning_s=None,
)  # fmt: skip


class Model:
    """Knows one part."""

    has_variance = True

    def knows(self, part: str) -> bool:
        return part == "a"


def printed(report: dict) -> str:
    stream = io.StringIO()
    print_report(report, Path("out"), Console(file=stream, width=200))
    return stream.getvalue()


def as_report(body: dict, experiment: str = "success") -> dict:
    return dict(experiment=experiment, worst=[], settings={}, versions={}) | body


def test_errors_are_those_of_the_definition():
    body = summarise([trial(), trial(number=1, success=False, reason="missed", measured=None)])
    numbers = body["overall"]
    assert numbers["trials"] == 2 and numbers["successes"] == 1 and numbers["success_rate"] == 0.5
    assert numbers["translation_rmse"] == pytest.approx(0.005)
    assert numbers["rotation_rmse"] == pytest.approx(0.2)
    assert numbers["translation_rmse_of_zero"] == pytest.approx(0.004)
    assert numbers["translation_interval"] is None  # of one part nothing can be said
    assert body["families"]["nut"]["reasons"] == {"missed": 1}


def test_error_bars_are_over_parts_not_over_grasps():
    """Two parts, one twice as far off: drawing parts again gives either, or both."""
    far = [trial(part="b", number=k, measured=[-0.003, 0.008, 0.0, 0.1]) for k in range(50)]
    near = [trial(number=k, measured=[0.0, 0.004, 0.0, 0.1]) for k in range(50)]
    low, high = summarise(far + near)["overall"]["translation_interval"]
    assert low == pytest.approx(0.005) and high == pytest.approx(0.010)


def test_without_a_success_errors_are_absent_not_zero(tmp_path: Path):
    trials = [trial(**NOTHING)]
    report = as_report(summarise(trials))
    numbers = report["overall"]
    assert numbers["translation_rmse"] is None and numbers["median_planning_s"] is None
    assert numbers["reasons"] == {"NoPartFound": 1}
    assert "0 of 1" in printed(report) and " - " in printed(report) and "nan" not in printed(report)
    draw_success(report, tmp_path / "success.png")
    draw_errors(trials, tmp_path / "errors.png")
    compared = as_report(compare(trials, {"one": Model()}), "displacement")
    assert compared["models"]["one"]["quality"]["known"]["translation_rmse"] is None
    assert "nan" not in printed(compared)
    draw_comparison(compared, tmp_path / "displacement.png")
    assert len(list(tmp_path.glob("*.png"))) == 3


def test_what_tape_did_not_measure_is_counted_and_is_no_number():
    unmeasured = trial(number=1, measured=None, unmeasured="one found: the larger square is seen, ...")
    planar = trial(measured=[0.0, 0.004, np.nan, -0.1], true=[0.0, 0.0043, 0.001, -0.1])
    report = as_report(summarise([planar, unmeasured]))
    assert report["overall"]["unmeasured"] == {"one found": 1}
    assert report["overall"]["measured"] == 1 and report["overall"]["successes"] == 2
    assert report["overall"]["translation_rmse"] == pytest.approx(0.005)
    assert report["tape_against_truth"]["flat"]["translation_rmse"] == pytest.approx(0.0003)
    assert "1 of 2 lifted not measured: one found 1" in printed(report)


def test_a_part_that_hung_askew_is_told_apart_where_tape_measures():
    lying = trial(measured=[0.0, 0.004, np.nan, 0.0], true=[0.0, 0.004, 0.0, 0.0])
    askew = trial(number=1, measured=[0.0, 0.004, np.nan, 0.0], true=[0.006, 0.004, 0.0, 0.0], tilt=0.2)
    found = summarise([lying, askew])["tape_against_truth"]
    assert found["flat"] == dict(found["flat"], trials=1, translation_worst=0.0)
    assert found["tilted"]["translation_worst"] == pytest.approx(0.006)


def test_models_are_compared_on_the_same_grasps_and_on_those_they_chose():
    expected = {"one": Prediction(mean=[0.0, 0.001, 0.0, -0.1], std=[0.01] * 4)}
    best = [trial(predictions=expected), trial(part="b", predictions=expected, measured=[0.0, 0.0, 0.0, 0.0])]
    chosen = trial(policy="low_variance", chosen_by="one", predicted=[0.0, 0.0039, 0.0, -0.1])
    report = as_report(compare([*best, chosen], {"one": Model(), "other": Model()}), "displacement")
    one = report["models"]["one"]
    assert one["quality"]["known"]["translation_rmse"] == pytest.approx(0.003)
    assert one["quality"]["novel"]["translation_rmse"] == pytest.approx(0.001)
    assert one["quality"]["novel"]["rotation_rmse"] == pytest.approx(0.1)
    assert one["low_variance"]["known"]["translation_rmse"] == pytest.approx(0.0001)
    assert one["quality"]["known"]["coverage_90"] == [1.0, 1.0, 1.0, 1.0]
    assert report["models"]["other"]["low_variance"] is None
    assert report["models"]["other"]["quality"]["known"]["translation_rmse"] is None
    section = next(s for s in sections(report, Path("out")) if s.title == "Displacement in the hand")
    assert ("one", "high quality", "novel") in [row[:3] for row in section.tables[0].rows]


def test_the_papers_bars_stand_beside_the_models_they_are_of():
    assert paper_label("gcip_mv") == paper_label("GCIP-M+V") == "GCIP-M+V"
    assert paper_label("lowess") == "LOWESS" and paper_label("ours") is None
    bar = PAPER["GCIP-M+V"]["low_variance"]
    assert bar["translation_rmse"] == pytest.approx(0.0024)
    assert np.degrees(bar["rotation_rmse"]) == pytest.approx(7.01)


def test_the_worst_are_sure_failures_then_the_farthest_off():
    sure = trial(number=1, success=False, reason="missed", measured=None, quality=0.99)
    unsure = trial(number=2, success=False, reason="missed", measured=None, quality=0.1)
    turned = trial(number=3, measured=[0.003, 0.0, 0.0, 1.1])
    trials = [trial(), unsure, turned, sure]
    assert [one.number for one in worst_trials(trials)] == [1, 2, 3, 0]
    assert [one.number for one in farthest_off(trials, 1)] == [3]
