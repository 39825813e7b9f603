"""Comparison of models, against numbers worked out by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mskgrasp.evaluate.comparison import PAPER, compare_models, figure_names, paper_label
from mskgrasp.evaluate.report import report_sections
from mskgrasp.trials.trial import Prediction
from tests.evaluate.made_trials import Model, report_of, trial


def test_models_are_compared_on_shared_grasps_and_on_their_own():
    expected = {"one": Prediction(mean=[0.0, 0.001, 0.0, -0.1], std=[0.01] * 4)}
    best = [trial(predictions=expected), trial(part="b", predictions=expected, measured=[0.0, 0.0, 0.0, 0.0])]
    chosen = trial(policy="low_variance", chosen_by="one", predicted=[0.0, 0.0039, 0.0, -0.1])
    recentred = trial(policy="recentred", chosen_by="one", predicted=[0.0, 0.0038, 0.0, -0.1])
    summary = compare_models([*best, chosen, recentred], {"one": Model(), "other": Model()})
    one = summary.models["one"]
    assert one.quality.known.translation_rmse == pytest.approx(0.003)
    assert one.quality.novel.translation_rmse == pytest.approx(0.001)
    assert one.quality.novel.rotation_rmse == pytest.approx(0.1)
    assert one.low_variance is not None
    assert one.low_variance.known.translation_rmse == pytest.approx(0.0001)
    assert one.recentred is not None and one.recentred.known.trials == 1
    assert one.recentred.known.translation_rmse == pytest.approx(0.0002)
    assert one.quality.known.coverage_90 == [1.0, 1.0, 1.0, 1.0]
    assert summary.models["other"].low_variance is None
    assert summary.models["other"].quality.known.translation_rmse is None
    section = next(
        s for s in report_sections(report_of(summary), Path("out")) if s.title == "Displacement in the hand"
    )
    rows = [row[:3] for row in section.tables[0].rows]
    low = "high quality and low variance"
    assert rows[:2] == [("one", "high quality", "all"), ("one", low, "all, known")]
    assert ("one", "high quality", "novel") in rows
    assert ("one", low, "known") not in rows  # it would repeat the row of all
    assert one.of("quality", "all") is one.quality.all


def test_labels_are_matched_with_the_papers_models():
    assert paper_label("gcip_mv") == paper_label("GCIP-M+V") == "GCIP-M+V"
    assert paper_label("lowess") == "LOWESS" and paper_label("ours") is None
    bar = PAPER["GCIP-M+V"]["low_variance"]
    assert bar is not None and bar.translation_rmse == pytest.approx(0.0024)
    assert np.degrees(bar.rotation_rmse) == pytest.approx(7.01)


def test_two_models_of_the_same_name_in_the_paper_both_appear_in_the_figure():
    assert figure_names(["gcip_mv", "GCIP.M.V", "ours"]) == {
        "GCIP-M+V": "gcip_mv", "GCIP.M.V": "GCIP.M.V", "ours": "ours"
    }  # fmt: skip
