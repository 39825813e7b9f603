"""Report of a table that was touched."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from hal.touch.plane import fit_plane
from hal.touch.report import TableReport, draw_table
from tests.hal.touch.tables import REGION, tilted

XY = np.array([[0.38, -0.12], [0.62, -0.12], [0.62, 0.12], [0.38, 0.12], [0.5, 0.0]])


def report(slope: tuple[float, float] = (0.0087, 0.0), stated: float | None = 0.0) -> TableReport:
    points = np.column_stack([XY, [tilted(0.003, slope)(xy) for xy in XY]])
    return TableReport(
        cell="cell.yaml", made="2026-01-01", region=REGION, stated_z=stated, points=points,
        plane=fit_plane(points, REGION, 5e-4), force=5.0, speed=0.01,
    )  # fmt: skip


def test_the_text_says_height_tilt_and_residuals():
    text = "\n".join(report().lines())
    assert "table_z 0.00300 m" in text and "+3.00 mm from the stated" in text
    assert "0.50 degrees, 1.04 mm" in text and "written as table_slope" in text
    text = "\n".join(report((0.0, 0.0), stated=None).lines())
    assert "stated" not in text and "no line is needed" in text


def test_the_values_are_plain_json():
    values = json.loads(json.dumps(report().to_json(), allow_nan=False))
    assert values["table_z"] == pytest.approx(0.003) and values["tilt_deg"] == pytest.approx(0.498, abs=1e-3)
    assert len(values["points"]) == len(values["residuals"]) == 5 and values["tilt_matters"] is True


@pytest.mark.parametrize("slope", [(0.0087, 0.0), (0.0, 0.0)])
def test_the_picture_is_small_and_not_empty(tmp_path: Path, slope: tuple[float, float]):
    draw_table(report(slope), tmp_path / "table.png")
    picture = np.asarray(Image.open(tmp_path / "table.png").convert("L"))
    assert (tmp_path / "table.png").stat().st_size < 100_000 and picture.std() > 5
