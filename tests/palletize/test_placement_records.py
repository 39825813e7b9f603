"""What placements amount to, by hand-made ones whose medians are known."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest
from rich.console import Console

from mskgrasp.palletize.placement_records import (
    Correction,
    Placement,
    compared,
    gain_lines,
    summarise_placements,
)
from mskgrasp.palletize.report import print_report


def placement(part: str, number: int, correction: Correction, error_mm: float | None, **changes) -> Placement:
    values = dict(
        part=part, number=number, slot=0, correction=correction, target=(0.5, 0.0, 1.0),
        placed=error_mm is not None, reason="" if error_mm is not None else "missed",
        translation_error=None if error_mm is None else error_mm * 1e-3,
        rotation_error=None if error_mm is None else error_mm * 1e-2,
    )  # fmt: skip
    return Placement(**(values | changes))  # type: ignore[arg-type]


ERRORS = {"none": (4.0, 6.0, 20.0), "predicted": (1.0, 3.0, 2.0), "truth": (0.1, 0.2, 0.3)}


def some() -> list[Placement]:
    return [
        placement(part, 0, correction, value)  # type: ignore[arg-type]
        for correction, values in ERRORS.items()
        for part, value in zip("abc", values, strict=True)
    ]


def test_medians_and_shares_are_those_of_the_errors():
    report = summarise_placements(some())
    assert report["compared"] == 3 and report["parts_compared"] == 3
    assert report["corrections"]["none"]["median_translation"] == pytest.approx(6e-3)
    assert report["corrections"]["predicted"]["median_translation"] == pytest.approx(2e-3)
    assert report["gain"]["predicted"]["translation_ratio"] == pytest.approx(1 / 3)
    assert report["gain"]["truth"]["rotation_ratio"] == pytest.approx(0.2 / 6)
    low, high = report["gain"]["predicted"]["translation_ratio_interval"]
    assert 0.1 <= low <= 1 / 3 <= high <= 0.5
    assert report["parts"]["b"]["median_translation"] == pytest.approx(
        {"none": 6e-3, "predicted": 3e-3, "truth": 2e-4}
    )
    assert "0.33" in gain_lines(report)[1] and gain_lines(report)[1].endswith(": met.")


def test_what_is_lost_under_one_correction_counts_under_none():
    """Else the one that loses the difficult parts looks best."""
    lost = [one for one in some() if not (one.part == "c" and one.correction == "predicted")]
    report = summarise_placements([*lost, placement("c", 0, "predicted", None)])
    assert report["compared"] == 2
    assert report["corrections"]["none"]["median_translation"] == pytest.approx(5e-3)
    assert report["corrections"]["predicted"]["reasons"] == {"missed": 1}
    assert report["corrections"]["none"]["measured"] == 3


def test_without_a_placement_errors_are_absent_not_zero():
    for lost in ([placement("a", 0, "none", None), placement("a", 0, "predicted", None)], []):
        report = summarise_placements(lost)
        assert all(row["median_translation"] is None for row in report["corrections"].values())
        assert all(row["translation_ratio"] is None for row in report["gain"].values())
        assert "errors are unknown" in gain_lines(report)[0]
        json.dumps(report, allow_nan=False)
        printed = io.StringIO()
        print_report(report, Console(file=printed, width=120))
        assert "0.0 mm" not in printed.getvalue()


def test_placed_but_unmeasured_is_no_error_of_zero():
    one = placement("a", 0, "none", None, placed=True, reason="", unmeasured="one found: ...")
    report = summarise_placements([one])
    assert (
        report["corrections"]["none"] | {"placed": 1, "measured": 0, "median_rotation": None}
        == (report["corrections"]["none"])
    )
    assert compared([one]) == []


def test_a_placement_survives_the_file():
    one = placement("a", 3, "truth", 1.5, grasp=[0.5, 0.0, 0.02, np.pi / 8])
    again = Placement.from_json(json.loads(json.dumps(one.to_json())))
    assert again == one and again.name == "a-003-00-truth"
