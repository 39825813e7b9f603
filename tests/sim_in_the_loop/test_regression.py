"""The comparison with the stored run: the same is the same, worse is told, and chance is no reason."""

from __future__ import annotations

import json

import numpy as np

from mskgrasp.palletize.placement_records import Placement
from tests.sim_in_the_loop.regression import PARTS, STORED, Row, compare, rows_of


def stored() -> list[Row]:
    return json.loads(STORED.read_text())["rows"]


def verdicts(now: list[Row]) -> dict[str, str]:
    return {figure["title"]: figure["verdict"] for figure in compare(stored(), now)}


def test_the_stored_run_is_the_fixed_set_and_equals_itself():
    rows = stored()
    assert {row["part"] for row in rows} == set(PARTS) and len(rows) >= 4 * len(PARTS)
    assert set(verdicts(rows).values()) == {"as before"}


def test_worse_predictions_are_told_and_better_ones_too():
    def scaled(factor: float) -> list[Row]:
        return [row | {"translation": row["translation"] and factor * row["translation"]} for row in stored()]

    assert verdicts(scaled(1.5))["RMSE of the displacement"] == "worse"
    assert verdicts(scaled(0.6))["RMSE of the displacement"] == "better"
    assert verdicts(scaled(1.01))["RMSE of the displacement"] == "worse", "of every trial by a hundredth"
    assert verdicts(scaled(1.5))["RMSE of the turn"] == "as before"


def test_a_single_lost_grasp_is_chance_and_many_are_not():
    rows = stored()
    held = [k for k, row in enumerate(rows) if row["held"]]

    def without(n: int) -> list[Row]:
        lost = dict(held=False, translation=None, rotation=None, placed=None, placed_plainly=None)
        return [row | lost if k in held[:n] else row for k, row in enumerate(rows)]

    assert verdicts(without(1))["held"] == "as before"
    assert verdicts(without(10))["held"] == "worse"
    assert verdicts(without(len(rows)))["median placement error"] == "unknown"


def test_rows_hold_what_was_predicted_and_measured():
    def placement(correction: str, error: float | None, **changes: object) -> Placement:
        values = dict(
            part="a", number=0, slot=0, correction=correction, target=(0.5, 0.0, 0.0), placed=True, reason="",
            predicted=[0.003, 0.0, 0.0, 3.1], measured=[0.0, 0.004, 0.0, -3.1], translation_error=error,
        )  # fmt: skip
        return Placement(**(values | changes))  # type: ignore[arg-type]

    (row,) = rows_of([placement("none", 0.004), placement("predicted", 0.001)])
    assert row["held"] and np.isclose(row["translation"], 0.005)
    assert np.isclose(row["rotation"], 2 * np.pi - 6.2)
    assert (row["placed_plainly"], row["placed"]) == (0.004, 0.001)
    lost = [placement(name, None, placed=False, measured=None) for name in ("none", "predicted")]
    (row,) = rows_of(lost)
    assert not row["held"] and row["translation"] is None
