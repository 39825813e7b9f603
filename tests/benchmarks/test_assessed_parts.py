"""Tables of assessed parts, from trials whose figures can be counted by hand."""

from __future__ import annotations

import numpy as np

from mskgrasp.assess.trials import EXACT
from mskgrasp.trials.placed_trial import PlacedTrial
from tests.benchmarks.assessed_parts import agreement, by_part, pooled


def trial(part: str, number: int, *, off: float, tilt: float = 0.0, lifted: bool = True) -> PlacedTrial:
    """A trial whose part is ``off`` metres from its prediction and from its target, or was not lifted."""
    known = PlacedTrial(
        part=part, condition=EXACT, number=number, planner="certified", planned_by="certified"
    )
    if not lifted:
        return PlacedTrial.from_json(known.to_json() | dict(reason="missed"))
    return PlacedTrial.from_json(
        known.to_json()
        | dict(
            lifted=True, predicted=[0.0] * 4, measured=[off, 0.0, 0.0, 0.1], held=[0.0] * 4,
            expected=[0.0] * 4, tilt=tilt, placed=[off, 0.0, 0.0],
        )
    )  # fmt: skip


GOOD = [trial("good", n, off=3e-4) for n in range(20)]
BAD = [
    *(trial("bad", n, off=3e-4) for n in range(8)),
    trial("bad", 8, off=4e-3, tilt=0.1),
    trial("bad", 9, off=0, lifted=False),
]


def test_figures_of_all_parts_count_failures_and_keep_errors_to_lifted_parts():
    rows = pooled({"good": GOOD, "bad": BAD}, {"good": GOOD, "bad": GOOD}).rows
    _, planned_by, trials, lifted, rmse, turn, near, placed, within_2, tilted = rows[0]
    assert (planned_by, trials) == ("certified", "30")
    assert lifted.startswith("96.7%")
    squares = 28 * 0.3**2 + 4.0**2
    assert rmse == f"{np.sqrt(squares / 29):.2f}"  # two parts have no interval
    assert turn == f"{np.degrees(0.1):.2f}"
    assert near.startswith("93.3%") and placed.startswith("93.3%") and within_2.startswith("93.3%")
    assert tilted.startswith("3.4%")  # one of the 29 that were lifted
    assert rows[-1][2] == "40"


def test_a_report_agrees_with_fresh_scenes_where_their_share_is_in_its_interval():
    bad_again = [trial("good", n, off=3e-3) for n in range(20)]
    agree = agreement({"good": GOOD, "bad": BAD}, {"good": GOOD, "bad": BAD}, "1mm,7deg")
    assert [row[3] for row in agree.rows] == ["2 of 2"] * 6
    off = agreement({"good": GOOD}, {"good": bad_again}, "1mm,7deg")
    assert [row[0] for row in off.rows if row[3] == "1 of 1"] == ["0.1 mm", "0.25 mm", "5 mm"]
    (row,) = by_part({"good": GOOD}, {"good": bad_again}, "1mm,7deg").rows
    assert row == ("good", "100%", "100%", "3.00", "100% [84%, 100%]", "0%", "no")
