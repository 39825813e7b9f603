"""The report of an evaluation as titled tables and figures: plain data for the console and for a page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from mskgrasp.evaluate.comparison import POLICIES, POLICY_NAMES, SIDES
from mskgrasp.reports import html as html_report

Rows = tuple[tuple[str, ...], ...]
WORST = "Worst trials"


@dataclass(frozen=True, kw_only=True)
class Section:
    """A piece of a report.

    Attributes:
        title: Over it.
        text: Sentences under the title.
        columns: Names of a table's columns; empty: no table.
        rows: Of the table, as text.
        figures: Picture files and their captions.
        on_page_only: Too long for the console.
    """

    title: str
    text: str = ""
    columns: tuple[str, ...] = ()
    rows: Rows = ()
    figures: tuple[tuple[Path, str], ...] = ()
    on_page_only: bool = False


def sections(report: dict[str, Any], folder: Path) -> list[Section]:
    """A report's pieces, in order.

    Args:
        report: As in ``report.json``.
        folder: Of the run; the figures lie there.
    """
    body = _success(report, folder) if report["experiment"] == "success" else _displacement(report, folder)
    worst = tuple((folder / name, caption) for name, caption in report["worst"])
    return [
        *body,
        *_tape(report),
        *([Section(title=WORST, figures=worst, on_page_only=True)] if worst else []),
        Section(
            title="Settings",
            columns=("setting", "value"),
            rows=tuple((name, str(value)) for name, value in report["settings"].items()),
            on_page_only=True,
        ),
        Section(
            title="Versions",
            columns=("of", "version"),
            rows=tuple((name, str(value)) for name, value in report["versions"].items()),
            on_page_only=True,
        ),
    ]


def page(report: dict[str, Any], folder: Path) -> list[html_report.Section]:
    """The pieces as `mskgrasp.reports.html.write_html` takes them, the worst trials behind links."""
    found = []
    for one in sections(report, folder):
        tables = [html_report.Table(header=one.columns, rows=one.rows)] if one.columns else []
        if one.title == WORST:
            rows = [
                (html_report.Link(text=path.stem, to=path.stem), text.removeprefix(f"{path.stem}: "))
                for path, text in one.figures
            ]
            tables = [html_report.Table(header=("trial", "outcome"), rows=rows)]
        pictures = [
            html_report.Picture(path=path, caption=text, name=path.stem) for path, text in one.figures
        ]
        text = one.text.splitlines()
        found.append(html_report.Section(title=one.title, text=text, tables=tables, pictures=pictures))
    return found


def print_report(report: dict[str, Any], folder: Path, console: Console) -> None:
    """Prints the tables that fit a console."""
    for section in sections(report, folder):
        if section.on_page_only:
            continue
        if section.columns:
            table = Table(title=section.title)
            for name in section.columns:
                table.add_column(name, justify="left" if name in _WORDS else "right")
            for row in section.rows:
                if row[0] in _TOTALS and table.rows:
                    table.add_section()
                table.add_row(*row)
            console.print(table)
        if section.text:
            console.print(section.text, highlight=False, soft_wrap=True)


_WORDS = (
    "part",
    "in the hand",
    "family",
    "failures",
    "model",
    "policy",
    "parts",
    "not measured",
    "setting",
    "value",
)
_TOTALS = ("all",)
_ERROR_COLUMNS = (
    "model", "policy", "parts", "measured", "RMSE", "of zero", "turn RMSE", "of zero", "in 90 %",
)  # fmt: skip
_EXPLAINED = (
    "RMSE over the measured successes [95 % interval over parts], beside that of predicting no displacement; "
    "in 90 %: how many lie within the predicted central 90 %. A part is known to a model that was made from "
    "grasps of it."
)
_SUCCESS_COLUMNS = ("lifted", "95 % interval", "RMSE", "of zero", "turn RMSE", "of zero", "failures")


def _success(report: dict[str, Any], folder: Path) -> list[Section]:
    overall, parts, families = report["overall"], report["parts"], report["families"]
    several = len(families) < len(parts)
    return [
        *([_by("Families", "family", families, on_page_only=False)] if several else []),
        _by("Parts", "part", parts, overall, text=_success_text(report)),
        Section(
            title="Figures",
            figures=(
                (folder / "success.png", "Share of grasps that lifted the part, with 95 % Wilson intervals"),
                (folder / "errors.png", "Measured displacement in the hand over the predicted one"),
            ),
            on_page_only=True,
        ),
    ]


def _by(
    title: str,
    what: str,
    groups: dict[str, Any],
    overall: dict[str, Any] | None = None,
    *,
    text: str = "",
    on_page_only: bool = False,
) -> Section:
    rows = [*groups.items(), *([("all", overall)] if overall is not None else [])]
    return Section(
        title=title,
        text=text,
        columns=(what, *_SUCCESS_COLUMNS),
        rows=tuple((name, *_success_row(one)) for name, one in rows),
        on_page_only=on_page_only,
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


def _success_text(report: dict[str, Any]) -> str:
    overall = report["overall"]
    rate = "-" if overall["success_rate"] is None else f"{overall['success_rate']:.1%}"
    paper = report["paper"]
    lines = [
        f"{rate} lifted, 95 % interval {interval_text(overall['success_interval'], digits=1)} (paper: "
        f"{paper['simulated']:.1%} simulated, {paper['real']:.1%} real)",
        *_common_text(overall),
    ]
    return "\n".join(lines)


def _common_text(overall: dict[str, Any]) -> list[str]:
    lines = []
    if overall["unmeasured"]:
        n = sum(overall["unmeasured"].values())
        lines.append(f"{n} of {overall['successes']} lifted not measured: {counted(overall['unmeasured'])}")
    if overall["median_planning_s"] is not None:
        lines.append(f"median planning time {overall['median_planning_s']:.2f} s")
    return lines


def _displacement(report: dict[str, Any], folder: Path) -> list[Section]:
    rows = []
    for side in SIDES:
        for label, model in report["models"].items():
            for policy in POLICIES:
                if model[policy] is None or not model[policy][side]["trials"]:
                    continue
                rows.append((f"{label}", POLICY_NAMES[policy], side, *_error_row(model[policy][side])))
    lifted = tuple(
        (name, f"{one['successes']} of {one['trials']}", interval_text(one["success_interval"]),
         counted(one["reasons"]), counted(one["unmeasured"]))
        for name, one in report["policies"].items()
    )  # fmt: skip
    paper = tuple(
        (label, POLICY_NAMES[policy], millimetres(bar["translation_rmse"]), degrees(bar["rotation_rmse"]))
        for label, bars in report["paper"].items()
        for policy, bar in bars.items()
        if bar is not None
    )
    return [
        Section(
            title="Lifted",
            columns=("policy", "lifted", "95 % interval", "failures", "not measured"),
            rows=lifted,
        ),
        Section(
            title="Displacement in the hand",
            text=_EXPLAINED,
            columns=_ERROR_COLUMNS,
            rows=tuple(rows),
            figures=((folder / "displacement.png", "As the paper's figure 5, with the paper's own bars"),),
        ),
        Section(
            title="The paper's",
            columns=("model", "policy", "RMSE", "turn RMSE"),
            rows=paper,
            on_page_only=True,
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


def _tape(report: dict[str, Any]) -> list[Section]:
    found = report["tape_against_truth"]
    if found is None:
        return []
    rows = []
    for name in ("flat", "tilted"):
        one = found[name]
        if one["trials"]:
            millimetres_, degrees_ = (
                [f"{scale * one[f'{kind}_{which}']:.2f} {unit}" for which in ("rmse", "worst")]
                for kind, scale, unit in (("translation", 1e3, "mm"), ("rotation", 180 / np.pi, "deg"))
            )
            rows.append((name, str(one["trials"]), *millimetres_, *degrees_))
    return [
        Section(
            title="Measured by tape, against the truth",
            text=f"in the plane; tilted: by over {np.degrees(found['tilt']):.0f} degree in the hand, "
            "and flat again when it is put down",
            columns=("in the hand", "trials", "RMS", "worst", "turn RMS", "worst"),
            rows=tuple(rows),
        )
    ]


def millimetres(value: float | None, interval: list[float] | None = None) -> str:
    """A length, with its interval where there is one; '-' where it is absent."""
    return _unit(value, interval, 1e3, "mm")


def degrees(value: float | None, interval: list[float] | None = None) -> str:
    """An angle, with its interval where there is one; '-' where it is absent."""
    return _unit(value, interval, 180 / np.pi, "deg")


def _unit(value: float | None, interval: list[float] | None, scale: float, unit: str) -> str:
    if value is None:
        return "-"
    around = "" if interval is None else f" [{interval[0] * scale:.1f}, {interval[1] * scale:.1f}]"
    return f"{value * scale:.1f} {unit}{around}"


def interval_text(interval: list[float] | None, digits: int = 0) -> str:
    """An interval of a share; '-' where it is absent."""
    return "-" if interval is None else f"{interval[0]:.{digits}%} - {interval[1]:.{digits}%}"


def counted(counts: dict[str, int]) -> str:
    """``missed 2, slipped 1``."""
    return ", ".join(f"{reason} {n}" for reason, n in counts.items())
