"""Report of an evaluation: its results, and their sections, tables and figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from mskgrasp.core.grasp import TILT_LIMIT
from mskgrasp.evaluate.comparison import GROUPS, POLICIES, POLICY_NAMES, SIDES, DisplacementSummary
from mskgrasp.evaluate.summary import WITHIN, Interval, SuccessSummary, TrialStatistics
from mskgrasp.reports.console import print_sections
from mskgrasp.reports.quantities import counted, degrees, millimetres
from mskgrasp.reports.section import Figure, Section, settings_section
from mskgrasp.runtime.console_table import Link, Table
from mskgrasp.trials.trial import REFUSED

TITLES = {"success": "Success of planned grasps", "displacement": "Displacement in the hand"}
_SUCCESS_COLUMNS = (
    "lifted", "95 % interval", "RMSE", "RMSE if none predicted", "turn RMSE", "turn RMSE if none predicted",
    "failures",
)  # fmt: skip
_ERROR_COLUMNS = (
    "model", "policy", "parts", "measured", "RMSE", "RMSE if none predicted", "turn RMSE",
    "turn RMSE if none predicted", "inside 90 % interval",
)  # fmt: skip
_ATTEMPT_COLUMNS = (
    "attempts", "lifted", *(f"off by at most {1e3 * most:g} mm" for most in WITHIN),
    f"tilted by over {np.degrees(TILT_LIMIT):g} deg", "RMSE without those", "turn RMSE without those",
)  # fmt: skip
_ATTEMPTS_EXPLAINED = (
    "Of all attempts, those that lifted nothing included, and those that lifted the part and were not "
    "measured left out: the share in which the part was lifted and the "
    "predicted displacement is off by at most so much. Tilted: share of the lifted parts that hang tilted in "
    "the hand. In brackets: 95 % interval by parts."
)
_ERRORS_EXPLAINED = (
    "RMSE: of the predicted displacement in the hand, over the grasps that lifted the part and were "
    "measured; RMSE if none predicted: of predicting that nothing moves, over the same grasps."
)
_INTERVALS_EXPLAINED = (
    "The interval of a single part is that of its own rate; of several parts, that of the mean rate of all "
    "such parts, which a few parts alike leave more open."
)
_COMPARISON_EXPLAINED = (
    f"{_ERRORS_EXPLAINED} In brackets: 95 % interval over parts. Inside 90 % interval: share of the measured "
    "values within 1.645 predicted standard deviations, the mean over dx, dy, dz and the turn. Known parts "
    "are those a model was trained on."
)


@dataclass(frozen=True, kw_only=True)
class Report:
    """Results of an evaluation.

    Attributes:
        summary: The numbers of its experiment.
        trials: Outcomes in words, by trial.
        worst: Captions of the pictures of the worst trials, by their paths in the run's folder.
        settings: Settings of the run.
        versions: Versions of the software.
    """

    summary: SuccessSummary | DisplacementSummary
    trials: dict[str, str]
    worst: dict[str, str]
    settings: dict[str, Any]
    versions: dict[str, str]

    def to_json(self) -> dict[str, Any]:
        """Convert to the content of ``report.json``."""
        summary = asdict(self.summary)
        tape: dict[str, Any] = summary["tape_against_truth"] or {}
        for name in tape.keys() - {"tilt"}:
            if not tape[name]["trials"]:
                tape[name] = dict(trials=0)
        return dict(
            summary,
            trials=[dict(trial=name, outcome=outcome) for name, outcome in self.trials.items()],
            worst=[list(pair) for pair in self.worst.items()],
            settings=self.settings,
            versions=self.versions,
        )


def report_sections(report: Report, folder: Path) -> list[Section]:
    """Make the sections of a report from its results and the figures in the run's folder."""
    summary = report.summary
    is_success = isinstance(summary, SuccessSummary)
    body = _success(summary, folder) if is_success else _displacement(summary, folder)
    return [
        *body,
        _tape(summary),
        _worst(report, folder),
        settings_section(report.settings, report.versions),
    ]


def conclusion(summary: SuccessSummary | DisplacementSummary) -> str:
    """State the result of an evaluation in one sentence.

    Of a comparison it is that of certified grasps, where there are any, else of the first model by the last
    policy that was measured.
    """
    if isinstance(summary, SuccessSummary):
        overall = summary.overall
        if overall.success_rate is None:
            return "No grasp was tried."
        text = (
            f"{overall.success_rate:.1%} of {overall.trials} trials lifted the part "
            f"(95 % interval {interval_text(overall.success_interval, digits=1)})"
        )
        if overall.translation_rmse is None:
            return text + "; no displacement was measured."
        return (
            f"{text}; RMSE of the predicted displacement in the hand: "
            f"{millimetres(overall.translation_rmse)} and {degrees(overall.rotation_rmse)}."
        )
    certified = summary.policies.get(POLICY_NAMES["certified"])
    if certified is not None and certified.translation_rmse is not None:
        errors = f"{millimetres(certified.translation_rmse)} and {degrees(certified.rotation_rmse)}"
        n, planned = certified.certified or (0, 0)
        return f"RMSE with the CAD known ({n} of {planned} planned grasps are certified): {errors}."
    label, model = next(iter(summary.models.items()))
    for policy in reversed(POLICIES):
        errors = [
            f"{millimetres(found.translation_rmse)} and {degrees(found.rotation_rmse)} on {side} parts"
            for side in SIDES
            if (found := model.of(policy, side)) is not None and found.translation_rmse is not None
        ]
        if errors:
            return f"RMSE of {label} ({POLICY_NAMES[policy]}): {', '.join(errors)}."
    return "No displacement was measured."


def print_report(report: Report, folder: Path, console: Console | None = None) -> None:
    """Print the sections that fit a console."""
    print_sections(report_sections(report, folder), console)


def _success(summary: SuccessSummary, folder: Path) -> list[Section]:
    by_family = Section(title="Families", tables=[_success_table("family", summary.families)])
    return [
        *([by_family] if 1 < len(summary.families) < len(summary.parts) else []),
        Section(
            title="Parts",
            text=[*_success_text(summary), _ERRORS_EXPLAINED, _INTERVALS_EXPLAINED],
            tables=[_success_table("part", summary.parts, summary.overall)],
        ),
        _attempts(("parts",), [(("all",), summary.overall)]),
        Section(
            title="Figures",
            figures=[
                Figure(
                    path=folder / "success.png",
                    caption="Share of grasps that lifted the part, with 95 % intervals",
                ),
                Figure(
                    path=folder / "errors.png",
                    caption="Measured displacement in the hand over the predicted one",
                ),
            ],
            page_only=True,
        ),
    ]


def _success_table(
    what: str, groups: Mapping[str, TrialStatistics], overall: TrialStatistics | None = None
) -> Table:
    rows = [*groups.items(), *([("all", overall)] if overall is not None else [])]
    return Table(
        header=(what, *_SUCCESS_COLUMNS),
        rows=[(name, *_success_row(one)) for name, one in rows],
        total=overall is not None,
    )


def _success_row(one: TrialStatistics) -> tuple[str, ...]:
    return (
        f"{one.successes} of {one.trials}",
        interval_text(one.success_interval),
        millimetres(one.translation_rmse),
        millimetres(one.translation_rmse_of_zero),
        degrees(one.rotation_rmse),
        degrees(one.rotation_rmse_of_zero),
        counted(one.reasons),
    )


def _success_text(summary: SuccessSummary) -> list[str]:
    overall, paper = summary.overall, summary.paper
    rate = "-" if overall.success_rate is None else f"{overall.success_rate:.1%}"
    text = f"{rate} lifted, 95 % interval {interval_text(overall.success_interval, digits=1)}"
    if overall.certified is None:  # the paper does not know its parts beforehand
        text += f" (paper: {paper['simulated']:.1%} simulated, {paper['real']:.1%} real)"
    lines = [text]
    lines.append(refused_text(overall.reasons, overall.trials, overall.successes))
    lines += _certified_text(overall)
    if overall.unmeasured:
        n = sum(overall.unmeasured.values())
        lines.append(f"{n} of {overall.successes} lifted not measured: {counted(overall.unmeasured)}")
    if overall.median_planning_s is not None:
        lines.append(f"median planning time {overall.median_planning_s:.2f} s")
    return lines


def _policy_text(one: TrialStatistics) -> list[str]:
    refused = [refused_text(one.reasons, one.trials, one.successes)] if one.reasons.get(REFUSED) else []
    return refused + _certified_text(one)


def _certified_text(one: TrialStatistics) -> list[str]:
    if one.certified is None:
        return []
    n, planned = one.certified
    simulated = f", {one.uncertified} simulated but not certified" if one.uncertified else ""
    rest = "; the others are the networks'" if n + one.uncertified < planned else ""
    return [f"{n} of {planned} planned grasps are certified{simulated}{rest}"]


def refused_text(reasons: Mapping[str, int], n_trials: int, n_lifted: int) -> str:
    """State the share of trials in which no grasp was tried, and the rate without them."""
    refused = reasons.get(REFUSED, 0)
    if not n_trials:
        return "no trial"
    text = f"refused, as no grasp was worth trying: {refused} of {n_trials} ({refused / n_trials:.0%})"
    if not refused:
        return text
    tried = n_trials - refused
    rate = f"; of the {tried} grasps tried {n_lifted / tried:.1%} lifted the part" if tried else ""
    return f"{text}, counted as not lifted{rate}"


def _displacement(summary: DisplacementSummary, folder: Path) -> list[Section]:
    lifted = [
        (name, f"{one.successes} of {one.trials}", interval_text(one.success_interval),
         counted(one.reasons), counted(one.unmeasured))
        for name, one in summary.policies.items()
    ]  # fmt: skip
    groups = [
        ((label, POLICY_NAMES[policy], name), found)
        for group in GROUPS
        for label, model in summary.models.items()
        for policy in POLICIES
        for name, found in model.rows(policy, group)
    ]
    certified = summary.policies.get(POLICY_NAMES["certified"])
    if certified is not None and certified.trials:
        groups.append((("with the CAD", POLICY_NAMES["certified"], "all"), certified))
    rows = [(*name, *_error_row(found)) for name, found in groups]
    paper = [
        (label, POLICY_NAMES[policy], millimetres(bar.translation_rmse), degrees(bar.rotation_rmse))
        for label, bars in summary.paper.items()
        for policy, bar in bars.items()
        if bar is not None
    ]
    return [
        Section(
            title="Lifted",
            text=[f"{name}: {line}" for name, one in summary.policies.items() for line in _policy_text(one)],
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
        _attempts(("model", "policy", "parts"), groups),
        Section(
            title="Results of the paper",
            tables=[Table(header=("model", "policy", "RMSE", "turn RMSE"), rows=paper)],
            page_only=True,
        ),
    ]


def _attempts(names: tuple[str, ...], groups: Sequence[tuple[tuple[str, ...], TrialStatistics]]) -> Section:
    """Shares of all attempts, and errors without parts that hang tilted; empty where none is measured."""
    rows = [
        (
            *name, one.trials, share_text(one.successes, one.trials, one.success_interval),
            *(share_text(each.n, each.of, each.interval) for each in one.within),
            "-" if one.tilted is None else share_text(one.tilted.n, one.tilted.of, one.tilted.interval),
            millimetres(one.flat_translation_rmse, one.flat_translation_interval),
            degrees(one.flat_rotation_rmse, one.flat_rotation_interval),
        )
        for name, one in groups
        if one.within is not None
    ]  # fmt: skip
    if not rows:
        return Section(title="Of all attempts")
    return Section(
        title="Of all attempts",
        text=[_ATTEMPTS_EXPLAINED],
        tables=[Table(header=(*names, *_ATTEMPT_COLUMNS), rows=rows)],
    )


def _error_row(one: TrialStatistics) -> tuple[str, ...]:
    return (
        f"{one.measured} ({one.measured_parts} parts)",
        millimetres(one.translation_rmse, one.translation_interval),
        millimetres(one.translation_rmse_of_zero),
        degrees(one.rotation_rmse, one.rotation_interval),
        degrees(one.rotation_rmse_of_zero),
        "-" if one.coverage_90 is None else f"{np.mean(one.coverage_90):.0%}",
    )


def _tape(summary: SuccessSummary | DisplacementSummary) -> Section:
    """Errors of measuring by tape, where simulation knows the truth; else empty."""
    title, found = "Measured by tape, against the truth", summary.tape_against_truth
    if found is None:
        return Section(title=title)
    rows = [
        (
            name, one.trials,
            *(f"{1e3 * (value or 0.0):.2f} mm" for value in (one.translation_rmse, one.translation_worst)),
            *(f"{np.degrees(value or 0.0):.2f} deg" for value in (one.rotation_rmse, one.rotation_worst)),
        )
        for name, one in (("flat", found.flat), ("tilted", found.tilted))
        if one.trials
    ]  # fmt: skip
    return Section(
        title=title,
        text=[
            "Errors in the plane. Tilted: parts that were tilted by more than "
            f"{np.degrees(found.tilt):.0f} degree in the hand, and came to rest flat when put down."
        ],
        tables=[
            Table(
                header=("in the hand", "trials", "RMS", "worst", "turn RMS", "worst turn"),
                rows=rows,
            )
        ],
    )


def _worst(report: Report, folder: Path) -> Section:
    figures = [
        Figure(path=folder / path, caption=caption, name=Path(path).stem)
        for path, caption in report.worst.items()
    ]
    rows = [(Link(text=one.name, to=one.name), one.caption.removeprefix(f"{one.name}: ")) for one in figures]
    tables = [Table(header=("trial", "outcome"), rows=rows)] if rows else []
    return Section(title="Worst trials", tables=tables, figures=figures, page_only=True)


def share_text(n: int, of: int, interval: Interval | None) -> str:
    """Format a share with its interval."""
    around = "" if interval is None else f" [{100 * interval[0]:.1f}, {100 * interval[1]:.1f}]"
    return f"{n / of:.1%}{around}"


def interval_text(interval: Interval | None, digits: int = 0) -> str:
    """Format an interval of a share; '-' for None."""
    return "-" if interval is None else f"{interval[0]:.{digits}%} - {interval[1]:.{digits}%}"
