"""The figure of a validation shows what its record holds."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from matplotlib.colors import same_color

from mskgrasp.core.palette import GREEN, INK, RED
from mskgrasp.validate import figure
from tests.figures import keep_figures, picture, tick_labels
from tests.validate.made_record import record


def test_without_comparisons_the_closed_form_errors_are_drawn_alone(tmp_path: Path, monkeypatch):
    kept = keep_figures(figure, monkeypatch)
    short = {name: record()[name] for name in ("closed_form", "parts")}
    assert figure.draw(tmp_path / "validate.png", short) == tmp_path / "validate.png"
    (axes,) = kept[0].axes
    assert tick_labels(axes) == ["fall", "way"]
    fall, way = axes.lines
    # 1 of 200 mm off, 5 allowed; the other one is off by more than the axis is long.
    assert fall.get_xdata()[0] == pytest.approx(0.2) and same_color(fall.get_color(), GREEN)
    assert way.get_xdata()[0] == 2.0 and same_color(way.get_color(), RED)
    assert picture(tmp_path / "validate.png").shape[1] == 1275


def test_a_check_that_no_tried_value_meets_is_drawn_at_the_edge(tmp_path: Path, monkeypatch):
    kept = keep_figures(figure, monkeypatch)
    beyond = dict(record()["closed_form"][1], measured=None)
    figure.draw(tmp_path / "validate.png", {"closed_form": [beyond]})
    (dot,) = kept[0].axes[0].lines
    assert dot.get_xdata()[0] == 2.0 and same_color(dot.get_color(), RED)


def test_settings_are_drawn_over_their_cost_and_variants_with_their_spread(tmp_path: Path, monkeypatch):
    kept = keep_figures(figure, monkeypatch)
    figure.draw(tmp_path / "validate.png", record())
    _, grid, sensitivity = kept[0].axes
    # Of three settings one was not measured; each other has an interval and a dot, in milliseconds and mm.
    assert [text.get_text() for text in grid.texts] == ["1000 Hz, 50 it", "250 Hz, 8 it"]
    dots = [line for line in grid.lines if line.get_marker() == "o"]
    assert [(line.get_xdata()[0], line.get_ydata()[0]) for line in dots] == [
        (80.0, pytest.approx(0.01)), (30.0, pytest.approx(0.01)),
    ]  # fmt: skip
    assert same_color(dots[0].get_color(), GREEN) and same_color(dots[1].get_color(), INK)
    assert dots[0].get_markersize() > dots[1].get_markersize()  # production is under test
    spans = [line for line in grid.lines if line.get_marker() != "o"]
    assert [list(line.get_ydata()) for line in spans] == [pytest.approx([-0.02, 0.05])] * 2
    assert tick_labels(sensitivity) == ["friction: 0.3", "friction: 0.8", "hulls: exact"]
    spreads = [line for line in sensitivity.lines if len(set(line.get_xdata())) == 2]
    assert [list(line.get_xdata()) for line in spreads] == [pytest.approx([0.04, 1.2])] * 2
    assert any(math.isclose(line.get_xdata()[0], 3.0) for line in sensitivity.lines)  # the displacement
    picture(tmp_path / "validate.png")
