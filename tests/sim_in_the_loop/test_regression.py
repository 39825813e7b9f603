"""Comparison with the stored run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mskgrasp.core.errors import BadDataset
from mskgrasp.palletize.placement_records import Placement
from tests.sim_in_the_loop.regression import PARTS, Row, compare, figures_of, read_stored, rows_of


def stored() -> list[Row]:
    return read_stored().rows


def verdicts(now: list[Row]) -> dict[str, str]:
    return {one.title: one.verdict for one in compare(stored(), now)}


def test_the_stored_run_is_the_fixed_set_and_equals_itself():
    rows = stored()
    assert {row.part for row in rows} == set(PARTS) and len(rows) >= 4 * len(PARTS)
    assert set(verdicts(rows).values()) == {"as before"}


def test_worse_and_better_predictions_are_reported():
    def scaled(factor: float) -> list[Row]:
        return [replace(row, translation=row.translation and factor * row.translation) for row in stored()]

    assert verdicts(scaled(1.5))["RMSE of the displacement"] == "worse"
    assert verdicts(scaled(0.6))["RMSE of the displacement"] == "better"
    assert verdicts(scaled(1.01))["RMSE of the displacement"] == "worse", "of every trial by a hundredth"
    assert verdicts(scaled(1.5))["RMSE of the turn"] == "as before"


def test_one_lost_grasp_is_within_chance_and_ten_are_not():
    rows = stored()
    held = [k for k, row in enumerate(rows) if row.held]

    def without(n: int) -> list[Row]:
        lost: dict[str, Any] = dict(
            held=False, translation=None, rotation=None, placed=None, placed_plainly=None
        )
        return [replace(row, **lost) if k in held[:n] else row for k, row in enumerate(rows)]

    assert verdicts(without(1))["lifted"] == "as before"
    assert verdicts(without(10))["lifted"] == "worse"
    assert verdicts(without(len(rows)))["median placement error"] == "unknown"


def test_rows_hold_what_was_predicted_and_measured():
    def placement(correction: str, error: float | None, **changes: object) -> Placement:
        values = dict(
            part="a", number=0, slot=0, correction=correction, target=(0.5, 0.0, 0.0), placed=True, reason="",
            predicted=[0.003, 0.0, 0.0, 3.1], measured=[0.0, 0.004, 0.0, -3.1], translation_error=error,
        )  # fmt: skip
        return Placement(**(values | changes))  # type: ignore[arg-type]

    (row,) = rows_of([placement("none", 0.004), placement("predicted", 0.001)])
    assert row.held and row.translation == pytest.approx(0.005)
    assert row.rotation == pytest.approx(2 * np.pi - 6.2)
    assert (row.placed_plainly, row.placed) == (0.004, 0.001)
    lost = [placement(name, None, placed=False, measured=None) for name in ("none", "predicted")]
    (row,) = rows_of(lost)
    assert not row.held and row.translation is None


def test_a_figure_has_the_interval_over_parts_and_a_lost_trial_has_no_error():
    def row(part: str, held: bool, error: float | None) -> Row:
        return Row(
            part=part,
            number=0,
            held=held,
            translation=error,
            rotation=error,
            placed=error,
            placed_plainly=None,
        )

    rows = [row("a", True, 0.003), row("a", True, 0.003), row("b", True, 0.004), row("c", False, None)]
    figures = {one.title: one for one in figures_of(rows)}
    assert "the same without correction" not in figures
    held = figures["lifted"]
    # Jeffreys's interval of four trials is 28 to 97, of three 23 to 98.
    assert (held.n, held.value) == (4, 75) and held.interval == pytest.approx((24, 98), abs=1)
    rmse = figures["RMSE of the displacement"]
    assert rmse.n == 3 and rmse.value == pytest.approx(np.sqrt((9 + 9 + 16) / 3))
    assert rmse.interval == pytest.approx((3, 4))  # parts are drawn whole: both draws may be a, or b
    assert figures["median placement error"].value == pytest.approx(3)


@pytest.mark.parametrize("text", ["", "[]", '{"rows": []}', '{"weights": "a", "rows": [{"part": "b"}]}'])
def test_a_file_that_is_no_stored_run_is_an_error_of_one_line(tmp_path: Path, text: str):
    path = tmp_path / "regression.json"
    path.write_text(text)
    with pytest.raises(BadDataset, match="is not a stored regression run; make one with --store") as raised:
        read_stored(path)
    assert "\n" not in str(raised.value)
