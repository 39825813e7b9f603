"""Figures of a benchmark show what they are given, with no attempt placed, too."""

from __future__ import annotations

import cv2
import pytest

from mskgrasp.benchmark import figures
from mskgrasp.benchmark.figures import draw_refusals, draw_shares
from mskgrasp.benchmark.summary import by_planner, refusals
from tests.benchmark.made_trials import failed, made
from tests.figures import keep_figures

GOOD = [made(number, quality=0.9) for number in range(4)]
NONE = [failed(number, "centroid", quality=None) for number in range(4)]


def n_blue(path) -> int:
    blue, green, red = cv2.split(cv2.imread(str(path)).astype(int))
    return int(((blue - red > 80) & (blue - green > 60)).sum())


@pytest.mark.parametrize("trials", [GOOD, NONE, GOOD + NONE])
def test_shares_are_drawn_for_any_trials(trials, tmp_path):
    draw_shares(trials, 0, tmp_path / "shares.png")
    assert n_blue(tmp_path / "shares.png") > 50  # the first planner's line


def test_refusals_are_drawn_for_planners_with_a_quality(tmp_path):
    draw_refusals(refusals(GOOD, 0), by_planner(GOOD), tmp_path / "some.png")
    draw_refusals(refusals(NONE, 0), by_planner(NONE), tmp_path / "none.png")
    assert n_blue(tmp_path / "some.png") > n_blue(tmp_path / "none.png") == 0


def test_a_planner_has_one_colour_in_both_figures(tmp_path, monkeypatch):
    kept, trials = keep_figures(figures, monkeypatch), NONE + GOOD  # the first predicts no quality
    draw_shares(trials, 0, tmp_path / "shares.png")
    draw_refusals(refusals(trials, 0), by_planner(trials), tmp_path / "refusals.png")
    shares, refused = ({line.get_label(): line.get_color() for line in one.axes[0].lines} for one in kept)
    assert refused == {GOOD[0].planner: shares[GOOD[0].planner]} != {GOOD[0].planner: shares[NONE[0].planner]}
