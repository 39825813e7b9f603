"""Figure of a validation: closed-form errors, settings over cost, sensitivity."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.ticker import NullFormatter, ScalarFormatter

from mskgrasp.core.palette import GREEN, INK, PALE_GREEN, RED
from mskgrasp.reports.style import saved_figure


def draw(path: Path, record: dict[str, Any]) -> Path:
    """Draw what a record holds: without comparisons the closed-form errors alone."""
    checks, compared = record["closed_form"], "grid" in record
    rows = max(len(checks), len(record.get("sensitivity", ())))
    with saved_figure(path, 17 if compared else 8.5, 0.24 * rows + 1.6) as figure:
        panels = figure.subplots(1, 3 if compared else 1, squeeze=False)[0]
        _draw_checks(panels[0], checks)
        if compared:
            _draw_grid(panels[1], record)
            _draw_sensitivity(panels[2], record)
    return path


def _draw_checks(axes: Any, checks: Sequence[dict[str, Any]]) -> None:
    axes.axvspan(-1, 1, color=PALE_GREEN, lw=0)
    for row, check in enumerate(checks):
        middle, half = (check["high"] + check["low"]) / 2, (check["high"] - check["low"]) / 2
        measured = check["measured"]  # null: beyond all that was tried
        error = 2.0 if measured is None else max(-2.0, min(2.0, (measured - middle) / half))
        axes.plot(error, row, "o", ms=6, color=GREEN if check["passed"] else RED)
    axes.set_yticks(range(len(checks)), [check["name"] for check in checks], fontsize=7)
    axes.set(xlim=(-2.2, 2.2), ylim=(len(checks) - 0.5, -0.5), xlabel="error in units of the tolerance")
    axes.set_title("Closed-form physics")


def _draw_grid(axes: Any, record: dict[str, Any]) -> None:
    margin = 1e3 * record["settings"]["margins"]["displacement"]
    axes.axhspan(-margin, margin, color=PALE_GREEN, lw=0)
    for one in record["grid"]:
        test = one["equivalence"]["displacement"]
        if test["estimate"] is None:
            continue
        low, middle, high = (1e3 * test[name] for name in ("low", "estimate", "high"))
        colour = GREEN if one["equivalent"] else INK
        axes.plot([one["cpu_ms"]] * 2, [low, high], color=colour, lw=1.2)
        under_test = one["setting"] == record["production"]
        axes.plot(one["cpu_ms"], middle, "o", ms=9 if under_test else 5, color=colour)
        axes.annotate(
            one["setting"], (one["cpu_ms"], high), xytext=(0, 4), textcoords="offset points", fontsize=7,
            rotation=60, fontweight="bold" if under_test else "normal",
        )  # fmt: skip
    axes.set(
        xlabel="processor time per grasp, ms",
        ylabel="median displacement beyond the floor, 90 % interval, mm",
        xscale="log",
    )
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.xaxis.set_minor_formatter(NullFormatter())
    costs = [one["cpu_ms"] for one in record["grid"]]
    axes.set_xticks([tick for tick in (20, 50, 100, 200, 400) if min(costs) / 2 < tick < 2 * max(costs)])
    axes.margins(x=0.15, y=0.15)
    axes.set_title(f"Against {record['yardstick']}; green: equivalent, shaded: margin", fontsize=9)


def _draw_sensitivity(axes: Any, record: dict[str, Any]) -> None:
    found = record["sensitivity"]
    for row, one in enumerate(found):
        if one["shift_median"] is None:
            continue
        low, high = 1e3 * one["shift_median"], 1e3 * one["shift_p90"]
        axes.plot([max(low, 1e-3), max(high, 1e-3)], [row, row], color=INK, lw=1)
        axes.plot(max(low, 1e-3), row, "o", ms=5, color=INK)
    own = record["size"]
    if own["shift_median"] is not None:
        axes.axvline(1e3 * own["shift_median"], color=GREEN, lw=1, ls="--")
    axes.set_yticks(range(len(found)), [f"{one['group']}: {one['label']}" for one in found], fontsize=7)
    axes.set(
        ylim=(len(found) - 0.5, -0.5), xscale="log", xlabel="difference to production, median to 90 %, mm"
    )
    axes.set_title("Sensitivity; dashed: median displacement", fontsize=9)
