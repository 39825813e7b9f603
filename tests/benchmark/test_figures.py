"""Figures of a benchmark show what they are given, with no attempt placed, too."""

from __future__ import annotations

import cv2
import pytest

from mskgrasp.benchmark.figures import draw_refusals, draw_shares
from mskgrasp.benchmark.summary import refusals
from tests.benchmark.made_trials import failed, made

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
    draw_refusals(refusals(GOOD, 0), tmp_path / "some.png")
    draw_refusals(refusals(NONE, 0), tmp_path / "none.png")
    assert n_blue(tmp_path / "some.png") > n_blue(tmp_path / "none.png") == 0
