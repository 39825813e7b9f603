"""Report of a palletizing run: sections, figures and ``report.json``."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from rich.console import Console

from mskgrasp.core.files import write_whole
from mskgrasp.palletize.config import PalletizeConfig
from mskgrasp.palletize.figures import draw_corrections, draw_errors, draw_pallets, placement_text
from mskgrasp.palletize.height_maps import read_height_maps
from mskgrasp.palletize.pallet_slots import Slot
from mskgrasp.palletize.placement_records import CORRECTIONS, Correction, Placement
from mskgrasp.palletize.summary import (
    Interval,
    PlacementSummary,
    compared_groups,
    group_part,
    summarise_placements,
)
from mskgrasp.reports.console import print_sections
from mskgrasp.reports.html import write_html
from mskgrasp.reports.quantities import counted, degrees, millimetres
from mskgrasp.reports.section import Figure, Section, settings_section
from mskgrasp.runtime.console_table import Link, Table
from mskgrasp.trials.trial import REFUSED

LEAST_PARTS = 3
"""Parts by which the goal is judged at least: an interval over two parts says nothing."""
GOAL = 0.2
"""Greatest share of the median error that correcting by the prediction is meant to leave."""
WORST = 10
_ROWS = 4
_WORDS: dict[Correction, str] = {"predicted": "the prediction", "truth": "the truth"}
_HEADER = (
    "correction", "placed", "measured", "median error", "95 % interval, mm", "median turn error",
    "95 % interval, deg", "not placed",
)  # fmt: skip
_DEFINITIONS = (
    "Error: distance of the placed part's centre from its target. Turn error: difference between the turn "
    "the part made and the turn commanded. Centre and direction of the longer side before the grasp are "
    "estimated from the depth image, so no column includes the error of that estimate.",
    "Correction none: the part is assumed not to move in the hand; predicted: displacement predicted by the "
    "network; truth: displacement measured in simulation, a lower bound. Goal: correcting by the prediction "
    f"leaves at most {GOAL:g} of the median error. Intervals: bootstrap over parts, 95 %.",
)


def write_report(
    config: PalletizeConfig, out: Path, placements: Sequence[Placement], slots: Sequence[Slot]
) -> PlacementSummary:
    """Summarise a run and write report.json, report.html and its figures.

    Args:
        config: Settings of the run.
        out: Folder of the run, with the pictures and height maps of the placements in ``placements``.
        placements: All placements of the run.
        slots: All slots.
    """
    summary = summarise_placements(placements)
    text = json.dumps(summary.to_json(), indent=1, allow_nan=False)
    write_whole(out / "report.json", text.encode() + b"\n")
    draw_errors(placements, out / "errors.png")
    errors = Section(
        title="Errors",
        text=_DEFINITIONS,
        figures=[Figure(path=out / "errors.png", caption="Distribution of the errors, and medians by part")],
    )
    sections = [
        result_section(summary),
        errors,
        _pallets(out, placements, slots, are_filled=config.slots is not None),
        _examples(out, placements),
        _parts(summary),
        _worst(out, placements),
        _lost(placements),
        settings_section(config.model_dump(mode="json")),
    ]
    write_html(out / "report.html", title="Palletizing", conclusion=_conclusion(summary), sections=sections)
    return summary


def print_report(summary: PlacementSummary, console: Console | None = None) -> None:
    """Print the counts and errors of each correction, and the gain of correcting."""
    print_sections([result_section(summary)], console)


def _conclusion(summary: PlacementSummary) -> str:
    rows = summary.corrections.values()
    placed = f"{sum(row.placed for row in rows)} of {sum(row.tried for row in rows)} placements succeeded"
    if not summary.compared:
        return f"{placed}; no error was measured under every correction."
    medians = [
        f"{name} {millimetres(row.median_translation)} and {degrees(row.median_rotation)}"
        for name, row in summary.corrections.items()
    ]
    return f"{placed}; median error by correction: {', '.join(medians)}."


def result_section(summary: PlacementSummary) -> Section:
    """Make the section of counts and errors by correction, and of the gain of correcting."""
    rows = [
        (
            name,
            f"{row.placed} of {row.tried}",
            row.measured,
            millimetres(row.median_translation),
            _interval_text(row.median_translation_interval, 1e3),
            degrees(row.median_rotation),
            _interval_text(row.median_rotation_interval, 180 / np.pi),
            counted(row.reasons) or "-",
        )
        for name, row in summary.corrections.items()
    ]
    text = [*gain_lines(summary), _refused_line(summary)]
    return Section(title="Result", text=text, tables=[Table(header=_HEADER, rows=rows)])


def _refused_line(summary: PlacementSummary) -> str:
    """State the share of placements that were not tried."""
    rows = summary.corrections.values()
    tried, refused = sum(row.tried for row in rows), sum(row.reasons.get(REFUSED, 0) for row in rows)
    share = f" ({refused / tried:.0%})" if tried else ""
    return f"Refused, as no grasp was worth trying: {refused} of {tried}{share}."


def _interval_text(interval: Interval | None, scale: float, digits: int = 1) -> str:
    return "-" if interval is None else " - ".join(f"{value * scale:.{digits}f}" for value in interval)


def gain_lines(summary: PlacementSummary) -> list[str]:
    """State the gain of correcting."""
    if not summary.compared:
        return ["No placement was measured under every correction: errors are unknown."]
    n, parts = summary.compared, summary.parts_compared
    lines = [f"Medians are of {n} placements of {parts} parts, those measured under every correction."]
    for name, gain in summary.gain.items():
        ratio = _ratio_text(gain.translation_ratio, gain.translation_ratio_interval)
        turn = _ratio_text(gain.rotation_ratio, gain.rotation_ratio_interval)
        text = f"Corrected by {_WORDS[name]}, the median error is {ratio} of that without, the turn's {turn}"
        if name == "predicted" and gain.translation_ratio is not None:
            judged = verdict(gain.translation_ratio, gain.translation_ratio_interval)
            few = f"not judged by {parts} parts, {LEAST_PARTS} are needed"
            text += f"; the goal is {GOAL:g} at most: {judged if parts >= LEAST_PARTS else few}"
        lines.append(text + ".")
    return lines


def verdict(ratio: float, interval: Interval | None) -> str:
    """Say whether a ratio of median errors meets the goal, and whether its interval does."""
    if ratio > GOAL:
        return "not met"
    return "met" if interval is not None and interval[1] <= GOAL else "met, but not by the whole interval"


def _ratio_text(ratio: float | None, interval: Interval | None) -> str:
    text = "-" if ratio is None else f"{ratio:.2f}"
    return text if interval is None else f"{text} ({_interval_text(interval, 1, digits=2)})"


def _pallets(
    out: Path, placements: Sequence[Placement], slots: Sequence[Slot], *, are_filled: bool
) -> Section:
    """Images of whole pallets, side by side by correction, and which are missing; empty without pallets."""
    figures, missing = [], []
    for number in sorted({one.number for one in placements}):
        images: dict[Correction, np.ndarray] = {}
        for name in CORRECTIONS:
            path = out / "placements" / f"pallet-{number:03d}-{name}.png"
            image = cv2.imread(str(path)) if path.exists() else None
            if image is not None:
                images[name] = image[..., ::-1]
        tried = {one.correction for one in placements if one.number == number}
        missing += [f"{number + 1} (correction {one})" for one in CORRECTIONS if one in tried - images.keys()]
        if images:
            path = out / f"pallet-{number:03d}.png"
            draw_pallets(images, slots, f"pallet {number + 1}", path)
            caption = (
                f"Pallet {number + 1} from above. Green: targets, the longer arm along the part's longer side"
            )
            figures.append(Figure(path=path, caption=caption))
    text = (
        f"No picture of pallet {', '.join(missing)}: the run was stopped after the last placement, before it "
        "was taken, or the hand hooked a part as it left."
    )
    return Section(title="Pallets", text=[text] if are_filled and missing else [], figures=figures)


def _examples(out: Path, placements: Sequence[Placement]) -> Section:
    """One placement of each of a few parts, before and after, side by side by correction."""
    by_part = {group_part(group): group for group in reversed(compared_groups(placements))}
    names = sorted(by_part)
    chosen = [names[int(i)] for i in np.linspace(0, len(names) - 1, min(_ROWS, len(names)))]
    rows = []
    for part in chosen:
        group = by_part[part]
        maps = {name: read_height_maps(out / "placements" / f"{one.name}.npz") for name, one in group.items()}
        maps = {name: maps[name] for name in CORRECTIONS if name in maps}
        rows.append((next(iter(group.values())), maps, group))
    if not rows:
        return Section(title="Examples")
    draw_corrections(rows, out / "placed.png")
    which = "each part" if len(chosen) == len(names) else f"{len(chosen)} of {len(names)} parts"
    caption = (
        f"The first compared placement of {which}: the part with the grasp, and the part as placed. Green: "
        "target, the longer arm along the part's longer side, and the part's outline at the target"
    )
    return Section(title="Examples", figures=[Figure(path=out / "placed.png", caption=caption)])


def _parts(summary: PlacementSummary) -> Section:
    names = list(summary.corrections)
    rows = [
        [part, row.compared]
        + [millimetres(row.median_translation[name]) for name in names]
        + [degrees(row.median_rotation[name]) for name in names]
        for part, row in summary.parts.items()
    ]
    header = ["part", "compared", *names, *(f"{name}, turn" for name in names)]
    return Section(
        title="Parts", tables=[Table(header=header, rows=rows, caption="Median errors by correction")]
    )


def _worst(out: Path, placements: Sequence[Placement]) -> Section:
    """The placements with the largest errors under the prediction, or under all corrections without it."""
    measured = [one for one in placements if one.translation_error is not None]
    predicted = [one for one in measured if one.correction == "predicted"] or measured
    worst = sorted(predicted, key=lambda one: -(one.translation_error or 0.0))[:WORST]
    rows, figures = [], []
    for one in worst:
        rows.append(
            [
                Link(text=one.part, to=one.name), one.number, one.slot, one.correction,
                millimetres(one.translation_error), degrees(one.rotation_error), _shift(one.predicted),
                _shift(one.measured),
            ]
        )  # fmt: skip
        path = out / "placements" / f"{one.name}.png"
        figures.append(Figure(path=path, caption=f"{one.name}: {placement_text(one)}", name=one.name))
    header = (
        "part",
        "trial",
        "slot",
        "correction",
        "error",
        "turn error",
        "predicted displacement",
        "measured displacement",
    )
    return Section(
        title="Worst placements",
        tables=[Table(header=header, rows=rows)] if rows else [],
        figures=figures,
    )


def _shift(displacement: list[float] | None) -> str:
    if displacement is None:
        return "-"
    x, y, _, turn = displacement
    return f"({x * 1e3:+z.1f}, {y * 1e3:+z.1f}) mm, {np.degrees(turn):+z.1f} deg"


def _why_lost(one: Placement) -> str:
    if one.refusal:
        return f"{one.reason}: {one.refusal}"
    return one.reason or f"not measured: {one.unmeasured}"


def _lost(placements: Sequence[Placement]) -> Section:
    """The placements without an error, and why."""
    rows = [
        [one.part, one.number, one.slot, one.correction, _why_lost(one)]
        for one in placements
        if one.translation_error is None
    ]
    header = ("part", "trial", "slot", "correction", "reason")
    return Section(
        title="Not placed or not measured", tables=[Table(header=header, rows=rows)] if rows else []
    )
