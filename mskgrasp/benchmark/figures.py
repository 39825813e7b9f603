"""Figures of a benchmark: shares placed within a distance, and precision against refusals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mskgrasp.benchmark.summary import ANGLE, COLUMNS, DISTANCE, Column, Refusal, by_planner, placing_error
from mskgrasp.core.palette import BLUE, FAINT, GREEN, INK, ORANGE, RED
from mskgrasp.reports.style import saved_figure
from mskgrasp.trials.placed_trial import PlacedTrial

NAMES: dict[Column, str] = {
    "none": "no correction", "predicted": "planner's prediction", "camera": "camera at the hand",
    "truth": "truth",
}  # fmt: skip
_WIDE, _THIN = dict(linestyle="-", linewidth=2.6, zorder=2), dict(linestyle="--", linewidth=1.3, zorder=3)
_LINES: list[dict[str, Any]] = [
    # In turn, so that a planner and its variant are both seen where their lines coincide.
    dict(color=colour, **look)
    for looks in ((_WIDE, _THIN), (_THIN, _WIDE))
    for colour, look in zip((BLUE, ORANGE, GREEN, INK, RED, FAINT), looks * 3, strict=True)
]


def draw_shares(trials: Sequence[PlacedTrial], seed: int, path: Path) -> None:
    """Draw for each correction the share of all attempts of each planner within any distance.

    The turn is within `ANGLE`.
    """
    planners = by_planner(trials)
    with saved_figure(path, 11.0, 3.6) as figure:
        axes = figure.subplots(1, len(COLUMNS), sharey=True)
        for axis, column in zip(axes, COLUMNS, strict=True):
            for (name, some), look in zip(planners.items(), _LINES, strict=False):
                errors = [placing_error(one, column, seed) for one in some]
                near = np.sort([one[0] for one in errors if one is not None and one[1] <= ANGLE])
                share = np.arange(len(near) + 1) / len(some)
                x = 1e3 * np.concatenate([[1e-6], near, [0.1]])
                axis.step(x, np.append(share, share[-1]), where="post", label=name, **look)
            axis.axvline(1e3 * DISTANCE, color=FAINT, linewidth=0.8)
            axis.set(xscale="log", xlim=(0.1, 20), ylim=(0, 1), title=NAMES[column], xlabel="distance, mm")
            axis.set_xticks([0.1, 0.25, 0.5, 1, 2, 5, 20], ["0.1", "", "0.5", "1", "2", "5", "20"])
        axes[0].set_ylabel("share of attempts within it")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 6), fontsize=9)


def draw_refusals(refused: Sequence[Refusal], planners: Iterable[str], path: Path) -> None:
    """Draw the share placed of the attempts that are tried against the share that is refused.

    ``planners`` are all of the benchmark, also those that predict no quality: a planner's line looks as in
    `draw_shares`.
    """
    with saved_figure(path, 11.0, 3.6) as figure:
        axis = figure.subplots()
        for name, look in zip(planners, _LINES, strict=False):
            some = [one for one in refused if one.planner == name]
            if not some:
                continue
            axis.plot(
                [one.refused for one in some], [one.placed.value for one in some], marker="o", markersize=3,
                label=name, **look,
            )  # fmt: skip
        axis.set(
            xlim=(-0.02, 1), ylim=(0, 1.02), xlabel="share refused", ylabel="share placed of those tried"
        )
        if refused:
            axis.legend(fontsize=9)
