"""Figures of an evaluation show the numbers of its summary."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Rectangle

from mskgrasp.core.palette import BLUE, GREEN
from mskgrasp.evaluate import figures
from mskgrasp.evaluate.comparison import compare_models
from mskgrasp.evaluate.summary import summarise_trials
from mskgrasp.trials.trial import Prediction
from tests.evaluate.made_trials import Model, trial
from tests.figures import keep_figures, legend_labels, picture, tick_labels


def test_parts_are_listed_from_the_worst_with_their_interval_and_reasons(tmp_path: Path, monkeypatch):
    kept = keep_figures(figures, monkeypatch)
    good = [trial(part="a", number=k) for k in range(4)]
    bad = [
        trial(part="b", family="bolt", number=k, success=k == 0, reason="" if k == 0 else "missed")
        for k in range(4)
    ]
    figures.draw_success(summarise_trials([*good, *bad]), tmp_path / "success.png")
    left, right = kept[0].axes
    assert tick_labels(left) == ["b (1 of 4)", "a (4 of 4)"]
    dots = [line.get_xdata()[0] for line in left.lines if line.get_marker() == "o"]
    assert dots == [0.25, 1.0]
    intervals = [line.get_xdata() for line in left.lines if len(line.get_xdata()) == 2 and line.get_lw() == 2]
    assert intervals[0] == pytest.approx((0.046, 0.699), abs=1e-3)  # Wilson (1927), 1 of 4
    assert "all: 62.5%" in legend_labels(left) and right.get_title(loc="left") == "3 not lifted"
    assert [bar.get_width() for bar in right.patches] == [3] and tick_labels(right) == ["missed"]
    assert picture(tmp_path / "success.png").shape[1] == 1500


def test_of_many_parts_the_worst_40_are_shown_and_families_where_they_are_fewer(tmp_path: Path, monkeypatch):
    kept = keep_figures(figures, monkeypatch)
    many = [trial(part=f"p{k}", family=f"f{k}", success=k != 7) for k in range(45)]
    figures.draw_success(summarise_trials(many), tmp_path / "a.png")
    assert len(tick_labels(kept[0].axes[0])) == 40 and tick_labels(kept[0].axes[0])[0] == "p7 (0 of 1)"
    assert kept[0].axes[0].get_title(loc="left") == "Lifted, by part, the worst 40 of 45"
    figures.draw_success(summarise_trials([trial(part=f"p{k}") for k in range(3)]), tmp_path / "b.png")
    assert tick_labels(kept[1].axes[0]) == ["nut (3 of 3)"]


def test_measured_displacements_are_drawn_over_the_predicted_ones_in_millimetres_and_degrees(
    tmp_path: Path, monkeypatch
):
    kept = keep_figures(figures, monkeypatch)
    unknown = trial(number=1, predicted_std=[np.nan] * 4, measured=[0.003, 0.0, np.nan, 0.1])
    figures.draw_displacements([trial(), unknown, trial(number=2, measured=None)], tmp_path / "errors.png")
    shift, turn = kept[0].axes
    points = {bars.get_label(): bars.lines[0] for bars in shift.containers}
    assert points["dx"].get_xdata().tolist() == [3, 3] and points["dx"].get_ydata().tolist() == [0, 3]
    assert points["dy"].get_ydata().tolist() == [4, 0]
    degrees = turn.containers[0].lines[0]
    np.testing.assert_allclose(degrees.get_ydata(), np.degrees([-0.1, 0.1]))
    # Errors of 5 and 0 mm, of 0.2 and 0 rad.
    assert shift.get_title(loc="left") == "Displacement in the hand: RMSE 3.5 mm"
    assert turn.get_title(loc="left") == "Turn in the hand: RMSE 8.1 deg"
    assert shift.get_xlim() == shift.get_ylim()  # the diagonal is at 45 degrees


def test_a_models_bars_stand_beside_the_papers_at_their_heights(tmp_path: Path, monkeypatch):
    kept = keep_figures(figures, monkeypatch)
    predictions = {"gcip_mv": Prediction(mean=[0.0, 0.001, 0.0, -0.1], std=[0.01] * 4)}
    best = [trial(predictions=predictions), trial(part="b", predictions=predictions)]
    figures.draw_comparison(compare_models(best, {"gcip_mv": Model()}), tmp_path / "displacement.png")
    axes = kept[0].axes[0]  # translation, known parts, in centimetres
    assert axes.get_title(loc="left") == "Translation RMSE, known parts"
    bars = [bar for bar in axes.patches if isinstance(bar, Rectangle)]
    own = [bar for bar in bars if bar.get_facecolor()[:3] == pytest.approx(_rgb(BLUE))]
    assert [bar.get_height() for bar in own] == pytest.approx([0.3])  # 4 mm measured, 1 mm predicted
    names = [label.get_text() for label in kept[0].axes[2].get_xticklabels()]
    assert names == ["LOWESS", "OCFI-M", "OCFI-M+V", "GCIP-M", "GCIP-M+V\ngcip_mv"]
    at = names.index("GCIP-M+V\ngcip_mv")
    assert abs(own[0].get_x() + own[0].get_width() / 2 - at) < 0.5
    assert sorted(bar.get_height() for bar in bars if abs(bar.get_x() - at) < 0.6) == pytest.approx(
        [0.24, 0.3, 0.43]  # figure 5 of the paper beside this run's
    )
    for tick in range(len(names)):
        group = [middle for bar in bars if abs((middle := bar.get_x() + bar.get_width() / 2) - tick) < 0.5]
        assert np.mean(group) == pytest.approx(tick)
    novel = kept[0].axes[2]
    assert min(bar.get_x() for bar in novel.patches) > 0.5  # LOWESS, the first, predicts no novel part
    assert picture(tmp_path / "displacement.png").shape[0] == 1110


def _rgb(colour: str) -> tuple[float, ...]:
    return tuple(int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))


def test_a_label_that_is_the_papers_name_is_written_once(tmp_path: Path, monkeypatch):
    kept = keep_figures(figures, monkeypatch)
    predictions = {"lowess": Prediction(mean=[0.0, 0.001, 0.0, -0.1], std=[0.01] * 4)}
    figures.draw_comparison(
        compare_models([trial(predictions=predictions)], {"lowess": Model()}), tmp_path / "one.png"
    )
    assert [label.get_text() for label in kept[0].axes[2].get_xticklabels()][0] == "LOWESS"


def test_certified_grasps_have_a_green_bar_beside_the_models(tmp_path: Path, monkeypatch):
    kept = keep_figures(figures, monkeypatch)
    predictions = {"gcip_mv": Prediction(mean=[0.0, 0.001, 0.0, -0.1], std=[0.01] * 4)}
    trials = [trial(predictions=predictions), trial(predictions=predictions, chosen_by="certified")]
    figures.draw_comparison(compare_models(trials, {"gcip_mv": Model()}), tmp_path / "displacement.png")
    for axes in (kept[0].axes[0], kept[0].axes[2]):
        bars = [bar for bar in axes.patches if isinstance(bar, Rectangle)]
        green = [bar for bar in bars if bar.get_facecolor()[:3] == pytest.approx(_rgb(GREEN))]
        assert [bar.get_height() for bar in green] == pytest.approx([0.5])  # 3 mm predicted, 4 mm across
        assert green[0].get_x() > max(bar.get_x() for bar in bars if bar is not green[0])
