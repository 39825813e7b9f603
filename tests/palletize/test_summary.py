"""Summaries of placements, on hand-made ones whose medians are known."""

from __future__ import annotations

import io
import json

import pytest
from rich.console import Console

from mskgrasp.palletize.report import gain_lines, print_report
from mskgrasp.palletize.summary import compared_groups, summarise_placements
from tests.palletize.made_placements import placement, some


def test_medians_and_ratios_are_those_of_the_errors():
    summary = summarise_placements(some())
    assert summary.compared == 3 and summary.parts_compared == 3
    assert summary.corrections["none"].median_translation == pytest.approx(6e-3)
    assert summary.corrections["predicted"].median_translation == pytest.approx(2e-3)
    gain = summary.gain["predicted"]
    assert gain.translation_ratio == pytest.approx(1 / 3)
    assert summary.gain["truth"].rotation_ratio == pytest.approx(0.2 / 6)
    assert gain.translation_ratio_interval is not None
    low, high = gain.translation_ratio_interval
    assert 0.1 <= low <= 1 / 3 <= high <= 0.5
    assert summary.parts["b"].median_translation == pytest.approx(
        {"none": 6e-3, "predicted": 3e-3, "truth": 2e-4}
    )
    assert "0.33" in gain_lines(summary)[1] and gain_lines(summary)[1].endswith(": not met.")


def test_a_part_lost_under_one_correction_counts_under_none():
    """Otherwise the correction that loses the difficult parts would seem the best."""
    lost = [one for one in some() if not (one.part == "c" and one.correction == "predicted")]
    summary = summarise_placements([*lost, placement("c", 0, "predicted", None)])
    assert summary.compared == 2
    assert summary.corrections["none"].median_translation == pytest.approx(5e-3)
    assert summary.corrections["predicted"].reasons == {"missed": 1}
    assert summary.corrections["none"].measured == 3


def test_without_a_placement_errors_are_absent_not_zero():
    for lost in ([placement("a", 0, "none", None), placement("a", 0, "predicted", None)], []):
        summary = summarise_placements(lost)
        assert all(row.median_translation is None for row in summary.corrections.values())
        assert all(row.translation_ratio is None for row in summary.gain.values())
        assert "errors are unknown" in gain_lines(summary)[0]
        json.dumps(summary.to_json(), allow_nan=False)
        printed = io.StringIO()
        print_report(summary, Console(file=printed, width=120))
        assert "0.0 mm" not in printed.getvalue()


def test_an_unmeasured_placement_has_no_error():
    one = placement("a", 0, "none", None, placed=True, reason="", unmeasured="one found: ...")
    none = summarise_placements([one]).corrections["none"]
    assert none.placed == 1 and none.measured == 0 and none.median_rotation is None
    assert compared_groups([one]) == []
