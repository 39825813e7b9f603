"""Tables, figure and JSON of a validation."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.ticker import NullFormatter, ScalarFormatter

from mskgrasp.core.grasp import MAX_DISPLACEMENT
from mskgrasp.core.palette import GREEN, INK, PALE_GREEN, RED
from mskgrasp.reports.console import print_sections
from mskgrasp.reports.section import Section
from mskgrasp.reports.style import saved_figure
from mskgrasp.runtime.console_table import Table
from mskgrasp.simulation.versions import versions
from mskgrasp.validate.closed_form import Check
from mskgrasp.validate.compare import MOST_DISAGREEMENT, MOST_TIMES_FLOOR, Comparison, complaints
from mskgrasp.validate.config import CELL_FLOOR, FLOOR, REFERENCE, ValidateConfig, setting_name
from mskgrasp.validate.convergence import Outcomes
from mskgrasp.validate.fidelity import Fidelity
from tasks.attempt.outcome import MAX_PENETRATION, MAX_SPEED

_FLOORS = (FLOOR, CELL_FLOOR)
_MARKERS = "o^sDvP"


@dataclass(frozen=True, kw_only=True)
class DiscardSummary:
    """Worst values among the labels of the setting under test, and how many attempts the collector drops.

    Attributes:
        attempts: Number of attempts.
        penetration: Deepest overlap of finger and part in the kept attempts, m.
        fastest: Greatest speed of a part in the kept attempts, m/s.
        displaced: Largest displacement of a kept success, m.
        dropped: Number of attempts by reason.
    """

    attempts: int
    penetration: float
    fastest: float
    displaced: float
    dropped: dict[str, int]


def summarise_discards(outcomes: Outcomes) -> DiscardSummary:
    """Counts the physically impossible outcomes and the worst values of the others."""
    way = np.linalg.norm(outcomes.displacement[:, :3], axis=1)
    reasons = {
        "penetrated": outcomes.penetration > MAX_PENETRATION,
        "too_fast": outcomes.fastest > MAX_SPEED,
        "moved_too_far": outcomes.success & (way > MAX_DISPLACEMENT),
        "not_finite": outcomes.success & ~np.isfinite(outcomes.displacement).all(axis=1),
    }
    kept = ~np.any(list(reasons.values()), axis=0)
    return DiscardSummary(
        attempts=len(kept),
        penetration=float(outcomes.penetration[kept].max(initial=0.0)),
        fastest=float(outcomes.fastest[kept].max(initial=0.0)),
        displaced=float(way[kept & outcomes.success].max(initial=0.0)),
        dropped={name: int(which.sum()) for name, which in reasons.items()},
    )


def print_checks(checks: Sequence[Check]) -> None:
    """Prints the closed-form physics, a row for each check."""
    rows = [
        (
            _mark(check.passed), check.name, check.formula, f"{check.expected:.4g}", f"{check.measured:.4g}",
            f"{check.low:.4g} .. {check.high:.4g}", check.unit,
        )
        for check in checks
    ]  # fmt: skip
    header = ("", "quantity", "formula", "expected", "measured", "tolerance", "unit")
    _print("Closed-form physics", Table(header=header, rows=rows))


def print_fidelity(found: Sequence[Fidelity]) -> None:
    """Prints the worst numbers over all parts, and every part that fails."""
    ratios = [f.volume_ratio for f in found]
    rows = [
        ("95 % of hull and mesh surfaces within", f"{1e3 * max(f.surface_p95 for f in found):.2f} mm"),
        ("volume of hulls over volume of mesh", f"{min(ratios):.3f} .. {max(ratios):.3f}"),
        ("relative error of the engine's mass", f"{max(f.mass_error for f in found):.1e}"),
        ("relative error of the engine's inertia", f"{max(f.inertia_error for f in found):.1e}"),
    ]
    failed = [f"{one.part} differs from its mesh: {one.as_dict()}" for one in found if not one.passed]
    title = f"{len(found)} parts in the physics engine against their meshes"
    _print(title, Table(header=("worst over parts", "value"), rows=rows), *failed)


def print_convergence(
    config: ValidateConfig, found: dict[str, Comparison], chosen: dict[str, str | None]
) -> None:
    """Prints the settings against the finest, and what each adds to the floors."""
    floor, reference = found[FLOOR], found[REFERENCE].success_rate
    rows = []
    for name, c in sorted(found.items(), key=lambda item: (item[0] not in _FLOORS, item[1].cpu_ms)):
        reasons = [] if name in (*_FLOORS, REFERENCE) else complaints(c, floor, reference)
        rows.append(
            (
                f"{name} (under test)" if name == config.production else name,
                f"{c.success_rate:.1%}", f"{c.agreement:.1%}",
                f"{1e3 * c.shift_median:.3f}", f"{1e3 * c.shift_p90:.2f}",
                f"{math.degrees(c.turn_median):.3f}", f"{math.degrees(c.turn_p90):.2f}",
                f"{c.p_value:.2g}", f"{1e3 * c.bias:.3f}", f"{c.bias_p:.1g}", f"{c.p_beyond:.2g}",
                f"{c.cpu_ms:.0f}", "; ".join(reasons) or "nothing",
            )
        )  # fmt: skip
    header = (
        "setting", "success", "same success", "shift median, mm", "90 %", "turn median, deg", "90 %",
        "p", "bias, mm", "bias p", "p beyond 0.05 mm", "CPU ms per grasp", "adds to the floor of 10 um",
    )  # fmt: skip
    cheapest = [
        f"cheapest setting that adds nothing to the floor ({name.removeprefix('the same, ')}): "
        f"{setting or 'none of these'}"
        for name, setting in chosen.items()
    ]
    _print(f"Grasps against {REFERENCE}", Table(header=header, rows=rows), *cheapest)


def print_discards(found: DiscardSummary) -> None:
    """Prints what the collector would drop, and the worst of what it would keep."""
    dropped = ", ".join(f"{count} {name}" for name, count in found.dropped.items() if count) or "none"
    print(
        f"\nof {found.attempts} attempts dropped as impossible: {dropped}; in the others the deepest overlap "
        f"is {1e3 * found.penetration:.2f} mm, the fastest part {found.fastest:.2f} m/s, "
        f"the largest displacement of a success {1e3 * found.displaced:.1f} mm"
    )


def _print(title: str, table: Table, *text: str) -> None:
    print_sections([Section(title=title, text=text, tables=[table])])


def write_json(path: Path, config: ValidateConfig, results: dict[str, Any]) -> None:
    """Writes settings, versions and results for other programs."""
    record = {"settings": config.model_dump(mode="json"), "versions": versions()} | results
    path.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def draw(
    path: Path, checks: Sequence[Check], config: ValidateConfig, found: dict[str, Comparison] | None
) -> Path:
    """Draws the closed-form errors in units of their tolerance and, where compared, accuracy over cost."""
    with saved_figure(path, 13 if found else 7.5, 0.32 * len(checks) + 1.6) as figure:
        panels = figure.subplots(
            1, 3 if found else 1, squeeze=False, width_ratios=(1.3, 1, 1) if found else None
        )[0]
        _draw_checks(panels[0], checks)
        if found:
            _draw_cost(panels[1], found, config, "agreement", "grasps with the same success, %", 100.0)
            _draw_cost(panels[2], found, config, "shift_p90", "90 % of displacements differ by less, mm", 1e3)
            panels[2].set_yscale("log")
            panels[2].set_yticks([0.5, 1, 2, 4], ["0.5", "1", "2", "4"])
            panels[2].yaxis.set_minor_formatter(NullFormatter())
    return path


def _draw_checks(axes: Any, checks: Sequence[Check]) -> None:
    axes.axvspan(-1, 1, color=PALE_GREEN, lw=0)
    for row, check in enumerate(checks):
        middle, half = (check.high + check.low) / 2, (check.high - check.low) / 2
        error = max(-2.0, min(2.0, (check.measured - middle) / half))
        axes.plot(error, row, "o", ms=6, color=GREEN if check.passed else RED)
    axes.set_yticks(range(len(checks)), [check.name for check in checks], fontsize=7.5)
    axes.set(xlim=(-2.2, 2.2), ylim=(len(checks) - 0.5, -0.5), xlabel="error in units of the tolerance")
    axes.set_title("Closed-form physics")


def _draw_cost(
    axes: Any, found: dict[str, Comparison], config: ValidateConfig, column: str, label: str, scale: float
) -> None:
    floor = scale * getattr(found[FLOOR], column)
    if column == "agreement":
        axes.axhspan(floor - scale * MOST_DISAGREEMENT, 100, color=PALE_GREEN, lw=0)
    else:
        axes.axhspan(0, MOST_TIMES_FLOOR * floor, color=PALE_GREEN, lw=0)
    for line, style in ((floor, ":"), (scale * getattr(found[CELL_FLOOR], column), "--")):
        axes.axhline(line, color=INK, lw=0.8, ls=style)
    rates = sorted({*config.rates_hz, config.physics.rate_hz})
    counts = sorted({*config.iterations, config.physics.position_iterations})
    markers = {rate: _MARKERS[k % len(_MARKERS)] for k, rate in enumerate(rates)}
    for k, count in enumerate(counts):
        row = [(rate, name) for rate in rates if (name := setting_name(rate, count)) in found]
        places = [(found[name].cpu_ms, scale * getattr(found[name], column)) for _, name in row]
        colour = colormaps["viridis"](0.85 * k / max(1, len(counts) - 1))
        axes.plot(*zip(*places, strict=True), color=colour, lw=1.2, label=f"{count} iterations", zorder=1)
        for (rate, name), place in zip(row, places, strict=True):
            fine = not complaints(found[name], found[FLOOR], found[REFERENCE].success_rate)
            axes.plot(*place, markers[rate], ms=6, color=colour, mfc=colour if fine else "white", zorder=2)
            if name == config.production:
                axes.plot(*place, "o", ms=13, color=INK, mfc="none", zorder=3)
    for rate, marker in markers.items():
        axes.plot([], [], marker, ms=5, color=INK, mfc="white", label=f"{rate} Hz")
    if column == "agreement":
        axes.legend(
            fontsize=7.5,
            loc="lower right",
            title="circled: under test\nfilled: adds nothing",
            title_fontsize=7.5,
        )
    axes.set(xlabel="processor time per grasp, ms", ylabel=label, xscale="log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(ScalarFormatter())
        axis.set_minor_formatter(NullFormatter())
    axes.set_xticks([50, 100, 200, 400])
    axes.set_title("Floors: 10 um (dotted), 0.1 mm (dashed)", fontsize=9)


def _mark(passed: bool) -> str:
    return "ok" if passed else "FAILED"
