"""Figures in the shared style: their size, their format, and nothing left behind."""

from __future__ import annotations

from pathlib import Path

import cv2
import matplotlib
import numpy as np
import pytest
from matplotlib import colors

from mskgrasp.core.palette import INK
from mskgrasp.reports.style import saved_figure


def test_a_picture_has_150_pixels_per_inch_and_the_styles_ink(tmp_path: Path):
    with saved_figure(tmp_path / "a.png", 2.0, 1.0) as figure:
        axes = figure.subplots()
        axes.set_title("A title")
        assert not axes.spines["top"].get_visible() and axes.spines["left"].get_visible()
        assert axes.title.get_color() == "auto" or colors.same_color(axes.title.get_color(), INK)
    picture = cv2.imread(str(tmp_path / "a.png"))
    assert picture is not None and picture.shape == (150, 300, 3)
    # The darkest pixels are the title's: of INK, not black. OpenCV's channels are blue, green, red.
    darkest = picture.reshape(-1, 3)[picture.sum(axis=2).argmin()][::-1]
    np.testing.assert_allclose(darkest, np.array(colors.to_rgb(INK)) * 255, atol=12)


def test_the_suffix_chooses_the_format(tmp_path: Path):
    with saved_figure(tmp_path / "a.pdf", 1.0, 1.0):
        pass
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")


def test_an_error_while_drawing_leaves_no_picture_and_no_style(tmp_path: Path):
    before = dict(matplotlib.rcParams)
    with pytest.raises(RuntimeError, match="no data"), saved_figure(tmp_path / "a.png", 1.0, 1.0):
        assert matplotlib.rcParams["text.color"] == INK
        raise RuntimeError("no data")
    assert dict(matplotlib.rcParams) == before and not list(tmp_path.iterdir())
