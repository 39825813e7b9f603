"""Figures kept for inspection after they are saved."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

import cv2
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure


def keep_figures(module: ModuleType, monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that a module saves from now on; they are saved as ever."""
    kept: list[Figure] = []
    save = module.saved_figure

    @contextmanager
    def saved_figure(path: Path, width: float, height: float) -> Iterator[Figure]:
        with save(path, width, height) as figure:
            yield figure
        kept.append(figure)

    monkeypatch.setattr(module, "saved_figure", saved_figure)
    return kept


def tick_labels(axes: Axes) -> list[str]:
    """Labels along the y axis, from the lowest position on."""
    return [label.get_text() for label in axes.get_yticklabels()]


def legend_labels(axes: Axes) -> list[str]:
    legend = axes.get_legend()
    return [] if legend is None else [text.get_text() for text in legend.get_texts()]


def picture(path: Path) -> np.ndarray:
    """A picture (h, w, 3), of which something is drawn."""
    found = cv2.imread(str(path))
    assert found is not None and found.std() > 5
    return found
