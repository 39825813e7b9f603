"""The report of an evaluation as sections."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from mskgrasp.evaluate.comparison import POLICIES, POLICY_NAMES, SIDES
from mskgrasp.reports.console import print_sections
from mskgrasp.reports.section import Figure, Section, settings_section
from mskgrasp.runtime.console_table import Link, Table

TITLES = {"success": "Success of planned grasps", "displacement": "Displacement in the hand"}
_SUCCESS_COLUMNS = (
    "lifted", "95 % interval", "RMSE", "RMSE if none predicted", "turn RMSE", "turn RMSE if none predicted",
    "failures",
)  # fmt: skip
_ERROR_COLUMNS = (
    "model", "policy", "parts", "measured", "RMSE", "RMSE if none predicted", "turn RMSE",
    "turn RMSE if none predicted", "inside 90 % interval",
)  # fmt: skip
_ERRORS_EXPLAINED = (
    "RMSE: of the predicted displacement in the hand, over the grasps that lifted the part and were "
    "measured; RMSE if none predicted: of predicting that nothing moves, over the same grasps."
)
_COMPARISON_EXPLAINED = (
    f"{_ERRORS_EXPLAINED} In brackets: 95 % interval over parts. Inside 90 % interval: share of the measured "
    "values within the predicted central 90 %. Known parts are those a model was made from grasps of."
)


def sections(report: dict[str, Any], folder: Path) -> list[Section]:
    """The sections of a report, in order.

    Args:
        report: As in ``report.json``.
        folder: Of the run, with the figures.
    """
    body = _success(report, folder) if report["experiment"] == "success" else _displacement(report, folder)
    return [
        *body,
        _tape(report),
        _worst(report, folder),
        settings_section(report["settings"], report["versions"]),
    ]


def conclusion(report: dict[str, Any]) -> str:
    """The result of an evaluation in one sentence."""
    if report["experiment"] == "success":
        overall = report["overall"]
        if overall["success_rate"] is None:
            return "No grasp was tried."
        text = (
            f"{overall['success_rate']:.1%} of {overall['trials']} planned grasps lifted the part "
            f"(95 % interval {interval_text(overall['success_interval'], digits=1)})"
        )
        if overall["translation_rmse"] is None:
            return text + "; no displacement was measured."
        return (
            f"{text}; RMSE of the predicted displacement in the hand: "
            f"{millimetres(overall['translation_rmse'])} and {degrees(overall['rotation_rmse'])}."
        )
    label, model = next(iter(report["models"].items()))
    errors = [
        f"{millimetres(model[policy][side]['translation_rmse'])} and "
        f"{degrees(model[policy][side]['rotation_rmse'])} on {side} parts ({POLICY_NAMES[policy]} grasps)"
        for policy in POLICIES
        for side in SIDES
        if model[policy] is not None and model[policy][side]["translation_rmse"] is not None
    ]
    return f"RMSE of {label}: {'; '.join(errors)}." if errors else "No displacement was measured."


def print_report(report: dict[str, Any], folder: Path, console: Console | None = None) -> None:
    """Prints the sections that fit a console."""
    print_sections(sections(report, folder), console)


def _success(report: dict[str, Any], folder: Path) -> list[Section]:
    overall, parts, families = report["overall"], report["parts"], report["families"]
    by_family = Section(title="Families", tables=[_success_table("family", families)])
    return [
        *([by_family] if len(families) < len(parts) else []),
        Section(
            title="Parts",
            text=[*_success_text(report), _ERRORS_EXPLAINED],
            tables=[_success_table("part", parts, overall)],
        ),
        Section(
            title="Figures",
            figures=[
                Figure(
                    path=folder / "success.png",
                    caption="Share of grasps that lifted the part, with 95 % Wilson intervals",
                ),
                Figure(
                    path=folder / "errors.png",
                    caption="Measured displacement in the hand over the predicted one",
                ),
            ],
            page_only=True,
        ),
    ]


def _success_table(what: str, groups: dict[str, Any], overall: dict[str, Any] | None = None) -> Table:
    rows = [*groups.items(), *([("all", overall)] if overall is not None else [])]
    return Table(
        header=(what, *_SUCCESS_COLUMNS),
        rows=[(name, *_success_row(one)) for name, one in rows],
        total=overall is not None,
    )


def _success_row(one: dict[str, Any]) -> tuple[str, ...]:
    return (
        f"{one['successes']} of {one['trials']}",
        interval_text(one["success_interval"]),
        millimetres(one["translation_rmse"]),
        millimetres(one["translation_rmse_of_zero"]),
        degrees(one["rotation_rmse"]),
        degrees(one["rotation_rmse_of_zero"]),
        counted(one["reasons"]),
    )


def _success_text(report: dict[str, Any]) -> list[str]:
    overall, paper = report["overall"], report["paper"]
    rate = "-" if overall["success_rate"] is None else f"{overall['success_rate']:.1%}"
    lines = [
        f"{rate} lifted, 95 % interval {interval_text(overall['success_interval'], digits=1)} (paper: "
        f"{paper['simulated']:.1%} simulated, {paper['real']:.1%} real)"
    ]
    if overall["unmeasured"]:
        n = sum(overall["unmeasured"].values())
        lines.append(f"{n} of {overall['successes']} lifted not measured: {counted(overall['unmeasured'])}")
    if overall["median_planning_s"] is not None:
        lines.append(f"median planning time {overall['median_planning_s']:.2f} s")
    return lines


def _displacement(report: dict[str, Any], folder: Path) -> list[Section]:
    lifted = [
        (name, f"{one['successes']} of {one['trials']}", interval_text(one["success_interval"]),
         counted(one["reasons"]), counted(one["unmeasured"]))
        for name, one in report["policies"].items()
    ]  # fmt: skip
    rows = [
        (label, POLICY_NAMES[policy], side, *_error_row(model[policy][side]))
        for side in SIDES
        for label, model in report["models"].items()
        for policy in POLICIES
        if model[policy] is not None and model[policy][side]["trials"]
    ]
    paper = [
        (label, POLICY_NAMES[policy], millimetres(bar["translation_rmse"]), degrees(bar["rotation_rmse"]))
        for label, bars in report["paper"].items()
        for policy, bar in bars.items()
        if bar is not None
    ]
    return [
        Section(
            title="Lifted",
            tables=[
                Table(header=("policy", "lifted", "95 % interval", "failures", "not measured"), rows=lifted)
            ],
        ),
        Section(
            title=TITLES["displacement"],
            text=[_COMPARISON_EXPLAINED],
            tables=[Table(header=_ERROR_COLUMNS, rows=rows)],
            figures=[
                Figure(
                    path=folder / "displacement.png",
                    caption="The models' errors as in figure 5 of the paper, beside those of the paper",
                )
            ],
        ),
        Section(
            title="Results of the paper",
            tables=[Table(header=("model", "policy", "RMSE", "turn RMSE"), rows=paper)],
            page_only=True,
        ),
    ]


def _error_row(one: dict[str, Any]) -> tuple[str, ...]:
    covered = one["coverage_90"]
    return (
        f"{one['measured']} ({one['measured_parts']} parts)",
        millimetres(one["translation_rmse"], one["translation_interval"]),
        millimetres(one["translation_rmse_of_zero"]),
        degrees(one["rotation_rmse"], one["rotation_interval"]),
        degrees(one["rotation_rmse_of_zero"]),
        "-" if covered is None else f"{np.mean(covered):.0%}",
    )


def _tape(report: dict[str, Any]) -> Section:
    """Errors of measuring by tape, where simulation knows the truth; empty without."""
    title, found = "Measured by tape, against the truth", report["tape_against_truth"]
    if found is None:
        return Section(title=title)
    rows = []
    for name in ("flat", "tilted"):
        one = found[name]
        if one["trials"]:
            lengths, angles = (
                [f"{scale * one[f'{kind}_{which}']:.2f} {unit}" for which in ("rmse", "worst")]
                for kind, scale, unit in (("translation", 1e3, "mm"), ("rotation", 180 / np.pi, "deg"))
            )
            rows.append((name, one["trials"], *lengths, *angles))
    return Section(
        title=title,
        text=[
            "Errors in the plane. Tilted: parts that were tilted by more than "
            f"{np.degrees(found['tilt']):.0f} degree in the hand, and lay flat again when put down."
        ],
        tables=[
            Table(
                header=("in the hand", "trials", "RMS", "worst", "turn RMS", "worst turn"),
                rows=rows,
            )
        ],
    )


def _worst(report: dict[str, Any], folder: Path) -> Section:
    figures = [
        Figure(path=folder / name, caption=caption, name=Path(name).stem) for name, caption in report["worst"]
    ]
    rows = [(Link(text=one.name, to=one.name), one.caption.removeprefix(f"{one.name}: ")) for one in figures]
    tables = [Table(header=("trial", "outcome"), rows=rows)] if rows else []
    return Section(title="Worst trials", tables=tables, figures=figures, page_only=True)


def millimetres(value: float | None, interval: list[float] | None = None) -> str:
    """A length with its interval, if any; '-' for None."""
    return _unit(value, interval, 1e3, "mm")


def degrees(value: float | None, interval: list[float] | None = None) -> str:
    """An angle with its interval, if any; '-' for None."""
    return _unit(value, interval, 180 / np.pi, "deg")


def _unit(value: float | None, interval: list[float] | None, scale: float, unit: str) -> str:
    if value is None:
        return "-"
    around = "" if interval is None else f" [{interval[0] * scale:.1f}, {interval[1] * scale:.1f}]"
    return f"{value * scale:.1f} {unit}{around}"


def interval_text(interval: list[float] | None, digits: int = 0) -> str:
    """An interval of a share; '-' for None."""
    return "-" if interval is None else f"{interval[0]:.{digits}%} - {interval[1]:.{digits}%}"


def counted(counts: dict[str, int]) -> str:
    """Counts as text, ``missed 2, slipped 1``."""
    return ", ".join(f"{reason} {n}" for reason, n in counts.items())
