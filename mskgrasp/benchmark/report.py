"""Report of a benchmark."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from mskgrasp.benchmark.figures import NAMES, draw_refusals, draw_shares
from mskgrasp.benchmark.part_list import BenchmarkPart
from mskgrasp.benchmark.summary import (
    ANGLE,
    ANGLES,
    CAMERA_POSITION,
    CAMERA_TURN,
    COLUMNS,
    DISTANCE,
    DISTANCES,
    STAGES,
    Budget,
    Refusal,
    Row,
    budgets,
    by_planner,
    refusals,
    stored_row,
    summarise,
    summary_json,
)
from mskgrasp.core.files import write_whole
from mskgrasp.core.share import Share
from mskgrasp.reports.html import write_html
from mskgrasp.reports.quantities import counted
from mskgrasp.reports.section import Figure, Section, settings_section
from mskgrasp.runtime.console_table import Table
from mskgrasp.trials.placed_trial import PlacedTrial

TOLERANCE = f"{1e3 * DISTANCE:g} mm and {np.degrees(ANGLE):g} degrees"


_STAGES = ("pose estimation", "closing", "transport", "release", "total")
"""Names of `STAGES` in tables."""


@dataclass(frozen=True, kw_only=True)
class RunFacts:
    """What a report says of its run.

    Attributes:
        cell: Name or file of the cell.
        noise: Noise of its camera.
        seed: Seed of the run.
        parts: The parts.
        trained_on: Numbers of parts that a planner's networks were trained on, by planner, where positive.
        chosen_by: Numbers of parts by which a planner's networks were chosen (early stopping) and calibrated,
            likewise.
        known_families: Numbers of parts of whose families a planner's networks were trained on, likewise.
        settings: Of the program.
    """

    cell: str
    noise: str
    seed: int
    parts: Sequence[BenchmarkPart]
    trained_on: Mapping[str, int]
    chosen_by: Mapping[str, int]
    known_families: Mapping[str, int]
    settings: Mapping[str, Any]


def write_report(out: Path, trials: Sequence[PlacedTrial], facts: RunFacts) -> tuple[str, list[Section]]:
    """Write report.html, report.json and the figures.

    Returns:
        The result in a line, and the sections for the console.
    """
    rows, refused, budget = summarise(trials, facts.seed), refusals(trials, facts.seed), budgets(trials)
    draw_shares(trials, facts.seed, out / "shares.png")
    draw_refusals(refused, by_planner(trials), out / "refusals.png")
    headline = conclusion(rows, facts)
    values = summary_json(
        rows, refused, budget, headline=headline, cell=facts.cell, noise=facts.noise, seed=facts.seed,
        parts=[part.name for part in facts.parts], trained_on=dict(facts.trained_on),
        chosen_by=dict(facts.chosen_by), known_families=dict(facts.known_families),
    )  # fmt: skip
    write_whole(out / "report.json", (json.dumps(values, indent=1, allow_nan=False) + "\n").encode())
    sections = [
        _first_section(rows, facts, out / "shares.png"),
        _tolerances_section(rows),
        _refusals_section(refused, out / "refusals.png"),
        _budget_section([one for one in budget if not one.part]),
        _parts_section(trials, facts),
        _part_budgets_section([one for one in budget if one.part]),
        # The noise of the settings is unset where it is that of the cell's file.
        settings_section({**facts.settings, "noise": facts.noise}),
    ]
    write_html(out / "report.html", title="Placed within a tolerance", conclusion=headline, sections=sections)
    return headline, sections


def stored_sections(values: Mapping[str, Any]) -> list[Section]:
    """The sections of a stored ``report.json``, without figures and parts.

    Raises:
        KeyError, TypeError, ValueError: It is not a report of `write_report`.
    """
    known = ("cell", "noise", "seed", "trained_on", "chosen_by", "known_families")
    facts = RunFacts(parts=(), settings={}, **{name: values[name] for name in known})
    rows = [stored_row(one) for one in values["rows"]]
    refused = [Refusal(**dict(one, placed=Share.from_json(one["placed"]))) for one in values["refusals"]]
    budget = [Budget(**one) for one in values["budgets"] if not one["part"]]
    none = Path()
    return [
        _first_section(rows, facts, none),
        replace(_tolerances_section(rows), page_only=False),
        _refusals_section(refused, none),
        _budget_section(budget),
    ]


def conclusion(rows: Sequence[Row], facts: RunFacts) -> str:
    """The planner that places most parts by its own prediction, or those that do, in a line."""
    most = max(row.first("predicted").value for row in rows)
    first = [row for row in rows if row.first("predicted").value == most]
    best = first[0]
    found, without = best.first("predicted"), best.first("none")
    lead = f"Of all {found.of} attempts at {best.n_parts} parts"
    noise = "" if facts.noise == "off" else f" with {facts.noise} noise"
    cell = f"in the cell {facts.cell}{noise}"
    if most == 0:
        return f"{lead}, no planner places any within {TOLERANCE}, {cell}."
    low, high = found.interval
    placed = f"{found.value:.0%} corrected by its prediction (95 % interval {low:.0%} to {high:.0%})"
    if len(first) > 1:
        names = " and ".join(row.planner for row in first)
        return f"{lead}, {names} each place {placed} within {TOLERANCE}, {cell}."
    places = "places" if len(rows) == 1 else "places most"
    return (
        f"{lead}, {best.planner} {places} within {TOLERANCE}: {placed}, {without.value:.0%} without a "
        f"correction, {cell}."
    )


def _first_section(rows: Sequence[Row], facts: RunFacts, figure: Path) -> Section:
    table = [
        (
            row.planner,
            _share(row.lifted),
            *(_share(row.first(column)) for column in COLUMNS),
            counted(row.reasons) or "-",
            row.wrong_pose,
        )
        for row in rows
    ]
    noise = "no noise" if facts.noise == "off" else f"{facts.noise} noise"
    text = [
        f"In the cell {facts.cell}, whose depth images have {noise}.",
        "The share of all attempts in which the part ends within the tolerance of where it was meant to be; "
        "attempts that find no grasp, refuse the part or do not lift it count as not placed.",
        "Corrected by the planner's prediction is what was simulated and measured; a planner without one "
        "predicts zero. The other columns follow from it: without a correction the part is off "
        "by its predicted displacement as well; a camera that looks at the part in the hand, with errors of "
        f"{1e3 * CAMERA_POSITION:g} mm along each axis and {np.degrees(CAMERA_TURN):g} degrees (standard "
        "deviations), and the truth leave what the way to the target and the release add.",
        *(
            f"The networks of {names} were trained on {n} of these parts."
            for names, n in _alike(facts.trained_on)
        ),
        *(
            f"The networks of {names} were chosen (early stopping) and calibrated by {n} of these parts."
            for names, n in _alike(facts.chosen_by)
        ),
        *(
            f"The networks of {names} were trained on other parts of the families of {n} of these parts."
            for names, n in _alike(facts.known_families)
        ),
    ]
    return Section(
        title=f"Placed within {TOLERANCE}",
        text=text,
        tables=[
            Table(
                header=("planner", "lifted", *(NAMES[one] for one in COLUMNS), "not placed", "wrong pose"),
                rows=table,
                caption="Shares of all attempts; 95 % intervals over parts. Wrong pose: attempts at "
                "a part taken to lie in another resting pose, which do not count as placed",
            )
        ],
        figures=[
            Figure(
                path=figure,
                caption=f"Share of attempts within a distance, and within {np.degrees(ANGLE):g} degrees",
            )
        ],
    )


def _alike(numbers: Mapping[str, int]) -> list[tuple[str, int]]:
    """Planners of the same number in words, and that number."""
    by_number: dict[int, list[str]] = {}
    for name, n in numbers.items():
        by_number.setdefault(n, []).append(name)
    return [(" and ".join(names), n) for n, names in by_number.items()]


def _tolerances_section(rows: Sequence[Row]) -> Section:
    which, turn = DISTANCES.index(DISTANCE), ANGLES.index(ANGLE)
    table = [
        (
            row.planner,
            NAMES[column],
            *(f"{grid[turn].value:.0%}" for grid in row.within[column]),
            *(f"{one.value:.0%}" for one in row.within[column][which]),
        )
        for row in rows
        for column in COLUMNS
    ]
    header = (
        "planner",
        "correction",
        *(f"{1e3 * distance:g} mm" for distance in DISTANCES),
        *(f"{np.degrees(angle):.0f} deg" for angle in ANGLES),
    )
    return Section(
        title="Other tolerances",
        text=[
            f"Shares within a distance and {np.degrees(ANGLE):g} degrees, and within {1e3 * DISTANCE:g} mm "
            "and an angle. All pairs are in report.json."
        ],
        tables=[Table(header=header, rows=table)],
        page_only=True,
    )


def _refusals_section(refused: Sequence[Refusal], figure: Path) -> Section:
    table = [
        (one.planner, f"{one.bound:.4f}", f"{one.refused:.0%}", one.parts, _share(one.placed))
        for one in refused
    ]
    return Section(
        title="Precision against refusals",
        text=[
            "Of the recorded attempts of planners that predict a quality, those under a bound on it are left "
            "out, as are those that the planner refused itself. "
            f"Placed: share of the others that end within {TOLERANCE}, corrected by the prediction."
        ],
        tables=[
            Table(
                header=("planner", "least quality", "refused", "parts tried", "placed of those tried"),
                rows=table,
            )
        ]
        if table
        else [],
        figures=[Figure(path=figure, caption="Share placed of those tried, by the share refused")]
        if table
        else [],
    )


def _budget_section(budget: Sequence[Budget]) -> Section:
    return Section(
        title="Error budget",
        text=[
            "Medians over the placed attempts, corrected by the prediction. Pose estimation: the "
            "found pose, or without CAD the centre of the part's box, less the true one; without CAD the "
            "seen centre is what is meant to be at the target, so that this error is not part of the total. "
            "Closing: the displacement in the hand less the predicted one. Transport: from the end of the "
            "lift to the moment before the release, a touch of the table included. Release: the rest."
        ],
        tables=[Table(header=("planner", "placed", *_STAGES), rows=[_budget_row(one) for one in budget])],
    )


def _part_budgets_section(budget: Sequence[Budget]) -> Section:
    rows = [(one.part, *_budget_row(one)) for one in sorted(budget, key=lambda one: one.part)]
    return Section(
        title="Error budget a part",
        tables=[Table(header=("part", "planner", "placed", *_STAGES), rows=rows)],
        page_only=True,
    )


def _budget_row(one: Budget) -> tuple[Any, ...]:
    def text(stage: str) -> str:
        distance, turn = one.distance[stage], one.turn[stage]
        if distance is None or turn is None:
            return "-"
        return f"{1e3 * distance:.2f} mm, {np.degrees(turn):.2f} deg"

    return one.planner, one.n, *(text(stage) for stage in STAGES)


def _parts_section(trials: Sequence[PlacedTrial], facts: RunFacts) -> Section:
    planners = by_planner(trials)
    rows = []
    for part in facts.parts:
        shares = []
        for some in planners.values():
            errors = [one.error("predicted") for one in some if one.part == part.name]
            hits = np.array(
                [e is not None and e[0] <= DISTANCE and e[1] <= ANGLE for e in errors], dtype=bool
            )
            found = Share.count(hits, [part.name] * len(hits))
            shares.append(f"{found.n} of {found.of}")
        rows.append((part.name, part.family, part.standard or "-", part.split, *shares))
    return Section(
        title="Parts",
        text=[f"Placed within {TOLERANCE}, corrected by the planner's prediction."],
        tables=[Table(header=("part", "family", "standard", "split", *planners), rows=rows)],
        page_only=True,
    )


def _share(found: Share) -> str:
    low, high = found.interval
    return f"{found.value:.0%} [{low:.0%}, {high:.0%}]"
