"""Figures of an evaluation: success, predicted displacements, comparison of models."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from mskgrasp.core.palette import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    LINE,
    MID_BLUE,
    MID_RED,
    ORANGE,
    PALE_BLUE,
    RED,
)  # fmt: skip
from mskgrasp.evaluate.comparison import (
    PAPER,
    POLICIES,
    POLICY_NAMES,
    SIDES,
    DisplacementSummary,
    ModelStatistics,
    figure_names,
)
from mskgrasp.evaluate.summary import Interval, SuccessSummary, displacement_errors, rms
from mskgrasp.reports.style import saved_figure
from mskgrasp.trials.trial import Policy, Trial

_COLOURS = {"dx": BLUE, "dy": ORANGE, "dz": FAINT, "turn": GREEN}
_OURS: dict[Policy, str] = {"quality": BLUE, "low_variance": RED, "recentred": ORANGE}
_PAPERS: dict[Policy, str] = {"quality": MID_BLUE, "low_variance": MID_RED}
_CAD = "with\nthe CAD"
_MOST_ROWS = 40
_BAR = 0.17
"""Width of a bar."""


def draw_success(summary: SuccessSummary, path: Path) -> None:
    """Draw success by family, or by part where every family has one part, and the reasons of failures."""
    overall = summary.overall
    by_family = len(summary.families) < len(summary.parts)
    groups = summary.families if by_family else summary.parts
    rows = sorted(groups.items(), key=lambda item: (item[1].success_rate, item[0]))
    shown = rows[:_MOST_ROWS]
    with saved_figure(path, 10, 1.8 + 0.24 * max(len(shown), 6)) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(3, 1))
        for y, (_, one) in enumerate(shown):
            left.plot(one.success_interval, [y, y], color=FAINT, lw=2, solid_capstyle="butt")
            left.plot(one.success_rate, y, "o", color=_OURS["quality"], ms=5)
        names = [f"{name} ({one.successes} of {one.trials})" for name, one in shown]
        left.set_yticks(range(len(shown)), names, fontsize=8)
        if overall.success_rate is not None and overall.success_interval is not None:
            left.axvspan(*overall.success_interval, color=PALE_BLUE, zorder=0, lw=0)
            rate = overall.success_rate
            left.axvline(rate, color=_OURS["quality"], lw=1.2, label=f"all: {rate:.1%}")
        if overall.certified is None:  # the paper does not know its parts beforehand
            paper = summary.paper["simulated"]
            left.axvline(paper, color=INK, lw=1, ls="--", label=f"paper, simulated: {paper:.1%}")
        rest = f", the worst {len(shown)} of {len(rows)}" if len(rows) > len(shown) else ""
        left.set_title(f"Lifted, by {'family' if by_family else 'part'}{rest}")
        left.set(xlim=(-0.02, 1.02), xlabel="share of grasps, 95 % intervals")
        left.set_ylim(-0.7, len(shown) - 0.3)
        left.legend(fontsize=8, loc="upper left")
        reasons = overall.reasons
        right.barh(
            list(reasons) or ["none"], list(reasons.values()) or [0], color=_OURS["low_variance"], height=0.5
        )
        right.set_title(f"{sum(reasons.values())} not lifted")
        right.xaxis.get_major_locator().set_params(integer=True)
        right.set_xlabel("grasps")
        right.set_ylim(-0.7, max(len(reasons), 5) - 0.3)
        right.set_xlim(left=0, right=max([1, *reasons.values()]) * 1.1)


def draw_displacements(trials: Sequence[Trial], path: Path) -> None:
    """Draw measured over predicted displacements of the successes, with predicted standard deviations."""
    measured = [trial for trial in trials if trial.measured is not None]
    predicted = np.array([trial.predicted for trial in measured]).reshape(-1, 4)
    deviation = np.array([trial.predicted_std for trial in measured]).reshape(-1, 4)
    true = np.array([trial.measured for trial in measured]).reshape(-1, 4)
    with saved_figure(path, 10, 4.8) as figure:
        shift, turn = figure.subplots(1, 2)
        for k, name in enumerate(("dx", "dy", "dz")):
            _points(shift, predicted[:, k] * 1e3, true[:, k] * 1e3, deviation[:, k] * 1e3, name)
        degrees = [np.degrees(values[:, 3]) for values in (predicted, true, deviation)]
        _points(turn, degrees[0], degrees[1], degrees[2], "turn")
        for axes, unit in ((shift, "mm"), (turn, "deg")):
            axes.axline((0, 0), slope=1, color=LINE, lw=1, zorder=0)
            low, high = (f(*axes.get_xlim(), *axes.get_ylim()) for f in (min, max))
            axes.set(xlabel=f"predicted, {unit}", ylabel=f"measured, {unit}", aspect="equal")
            axes.set(xlim=(low, high), ylim=(low, high))
        rmse = ("none measured", "none measured")
        if measured:
            distance, angle = map(rms, displacement_errors(predicted, true))
            rmse = (f"RMSE {distance * 1e3:.1f} mm", f"RMSE {np.degrees(angle):.1f} deg")
        shift.set_title(f"Displacement in the hand: {rmse[0]}")
        turn.set_title(f"Turn in the hand: {rmse[1]}")
        shift.legend(loc="lower right")


def _points(
    axes: Axes, predicted: np.ndarray, measured: np.ndarray, deviation: np.ndarray, name: str
) -> None:
    known = np.where(np.isfinite(deviation), deviation, 0.0)
    axes.errorbar(
        predicted, measured, xerr=known, fmt="o", ms=4, lw=0.8, alpha=0.8, color=_COLOURS[name], label=name
    )


def draw_comparison(summary: DisplacementSummary, path: Path) -> None:
    """Draw each model's RMSE under both policies as in figure 5 of the paper, beside the paper's bars.

    Rows: known and novel parts; columns: translation and rotation. The paper's bars are of known and novel
    parts together and appear in both rows, as those of certified grasps do, which know the CAD of all. A bar
    without an interval is of a single part.
    """
    models = summary.models
    ours = figure_names(models)
    certified = summary.policies.get(POLICY_NAMES["certified"])
    order = [*PAPER, *(name for name in ours if name not in PAPER), *([_CAD] if certified else [])]
    with saved_figure(path, 5 + 1.4 * len(order), 7.4) as figure:
        grid = figure.subplots(2, 2, sharex=True, sharey="col")
        for row, side in zip(grid, SIDES, strict=True):
            for axes, kind, scale, unit in zip(
                row, ("translation", "rotation"), (100.0, 180 / np.pi), ("cm", "degrees"), strict=True
            ):
                if certified is not None:
                    value = getattr(certified, f"{kind}_rmse")
                    interval = getattr(certified, f"{kind}_interval")
                    _bar(axes, order.index(_CAD), value, interval, scale, GREEN)
                for x, name in enumerate(order):
                    own, papers = _policies_of(models.get(ours.get(name, "")), name)
                    first = x - (len(own) + len(papers) - 1) / 2 * _BAR
                    for k, policy in enumerate(own):
                        found = models[ours[name]].of(policy, side)
                        if found is not None and found.trials:
                            value = getattr(found, f"{kind}_rmse")
                            interval = getattr(found, f"{kind}_interval")
                            _bar(axes, first + k * _BAR, value, interval, scale, _OURS[policy])
                    for k, policy in enumerate(papers, len(own)):
                        paper = PAPER[name][policy]
                        if paper is not None and (name, side) != ("LOWESS", "novel"):  # fitted to known parts
                            value = getattr(paper, f"{kind}_rmse")
                            _bar(axes, first + k * _BAR, value, None, scale, _PAPERS[policy])
                axes.set_title(f"{kind.capitalize()} RMSE, {side} parts")
                axes.set_ylabel(unit)
                labels = [_tick_label(name, ours.get(name, name)) for name in order]
                axes.set_xticks(range(len(order)), labels, fontsize=8)
                axes.set_ylim(bottom=0)
                axes.set_xlim(-0.6, len(order) - 0.4)
        handles = [
            Patch(color=colours[policy], label=f"{POLICY_NAMES[policy]}, {who}")
            for who, colours in (("this run", _OURS), ("paper (all parts)", _PAPERS))
            for policy in colours
        ]
        if certified is not None:
            label = f"{POLICY_NAMES['certified']}, this run (all parts)"
            handles.append(Patch(color=GREEN, label=label))
        figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=9)


def _policies_of(model: ModelStatistics | None, name: str) -> tuple[list[Policy], list[Policy]]:
    """Policies that have a bar on either side: of a model of this run, and of the paper's of that name."""
    own: list[Policy] = []
    for policy in POLICIES:
        sides = [] if model is None else [model.of(policy, side) for side in SIDES]
        if any(one is not None and one.trials for one in sides):
            own.append(policy)
    return own, [policy for policy, bar in PAPER.get(name, {}).items() if bar is not None]


def _tick_label(name: str, label: str) -> str:
    return name if label.lower() == name.lower() else f"{name}\n{label}"


def _bar(
    axes: Axes, x: float, value: float | None, interval: Interval | None, scale: float, colour: str
) -> None:
    """Draw an error with its interval; a dash where no trial was measured."""
    if value is None:
        axes.text(x, 0, "-", ha="center", va="bottom", color=colour)
        return
    axes.bar(x, value * scale, _BAR, color=colour)
    if interval is not None:
        reach = [[max(value - interval[0], 0) * scale], [max(interval[1] - value, 0) * scale]]
        axes.errorbar(x, value * scale, yerr=reach, color=INK, lw=1, capsize=2.5)
