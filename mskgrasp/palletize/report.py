"""What a palletizing run leaves for people: figures, report.json, and one report.html."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from pydantic import BaseModel

from mskgrasp.core.files import write_whole
from mskgrasp.palletize.figures import draw_comparison, draw_errors, draw_pallets, outcome_text
from mskgrasp.palletize.placements import (
    CORRECTIONS,
    GOAL,
    HEADER,
    Correction,
    Placement,
    compared,
    degrees,
    gain_lines,
    millimetres,
    summarise_placements,
    table_rows,
)
from mskgrasp.palletize.slots import Slot
from mskgrasp.palletize.views import read_views
from mskgrasp.reports.html import Link, Picture, Section, Table, settings_section, write_html

WORST = 10
_ROWS = 4
_DEFINITIONS = (
    "Error: distance of the placed part's centre from its target, and the difference between the turn it "
    "made and the one it was asked for. The centre and the direction of the longer side are those that the "
    "depth image showed before the grasp: what seeing them costs is in no column.",
    "Correction none: as if nothing had moved in the hand; predicted: by the displacement network; truth: by "
    "what the tracker saw in the hand, which a prediction beats by luck alone. Goal: the prediction leaves "
    f"{GOAL:g} of the median error at most. Intervals: bootstrap over parts, 95 %.",
)


def write_report(
    config: BaseModel, out: Path, placements: Sequence[Placement], slots: Sequence[Slot]
) -> dict[str, Any]:
    """Sums a run up and writes report.json, report.html and the pictures in it.

    Args:
        config: Settings of the run.
        out: Its folder, with the pictures and views of the placements in ``placements``.
        placements: All of them.
        slots: Where they went.

    Returns:
        What report.json holds.
    """
    report = summarise_placements(placements)
    text = json.dumps(report, indent=1, allow_nan=False)
    write_whole(out / "report.json", text.encode() + b"\n")
    draw_errors(placements, out / "errors.png")
    sections = [
        Section(
            title="Result",
            text=[*gain_lines(report), *_DEFINITIONS],
            tables=[Table(header=HEADER, rows=table_rows(report))],
            pictures=[
                Picture(path=out / "errors.png", caption="How large the errors are, and each part's medians")
            ],
        ),
        _pallets(out, placements, slots),
        _examples(out, placements),
        _parts(report),
        _worst(out, placements),
        _lost(out, placements),
        settings_section(config),
    ]
    kept = [one for one in sections if one.text or one.tables or one.pictures]
    write_html(out / "report.html", title="Palletizing", sections=kept)
    return report


def _pallets(out: Path, placements: Sequence[Placement], slots: Sequence[Slot]) -> Section:
    """Whole pallets, where the run has any, beside each other by correction."""
    pictures = []
    for number in sorted({one.number for one in placements}):
        images: dict[Correction, np.ndarray] = {}
        for name in CORRECTIONS:
            path = out / "placements" / f"pallet-{number:03d}-{name}.png"
            image = cv2.imread(str(path)) if path.exists() else None
            if image is not None:
                images[name] = image[..., ::-1]
        if images:
            path = out / f"pallet-{number:03d}.png"
            draw_pallets(images, slots, f"pallet {number + 1}", path)
            caption = (
                f"Pallet {number + 1} from above; green: targets, the longer arm along the part's longer side"
            )
            pictures.append(Picture(path=path, caption=caption))
    return Section(title="Pallets", pictures=pictures)


def _examples(out: Path, placements: Sequence[Placement]) -> Section:
    """One placement of each of a few parts, before and after, beside each other by correction."""
    by_part = {group_part(group): group for group in reversed(compared(placements))}
    names = sorted(by_part)
    chosen = [names[int(i)] for i in np.linspace(0, len(names) - 1, min(_ROWS, len(names)))]
    rows = []
    for part in chosen:
        group = by_part[part]
        views = {name: read_views(out / "placements" / f"{one.name}.npz") for name, one in group.items()}
        views = {name: views[name] for name in CORRECTIONS if name in views}
        rows.append((next(iter(group.values())), views, group))
    if not rows:
        return Section(title="Examples")
    draw_comparison(rows, out / "placed.png")
    caption = (
        "The first compared placement of each part: the grasp, and where the part came to lie. Green: the "
        "target, its longer arm along the part's longer side, and the part's outline there"
    )
    return Section(title="Examples", pictures=[Picture(path=out / "placed.png", caption=caption)])


def group_part(group: dict[Correction, Placement]) -> str:
    """The part that all placements of a group are of."""
    return next(iter(group.values())).part


def _parts(report: dict[str, Any]) -> Section:
    names = list(report["corrections"])
    rows = [
        [part, row["compared"]]
        + [millimetres(row["median_translation"][name]) for name in names]
        + [degrees(row["median_rotation"][name]) for name in names]
        for part, row in report["parts"].items()
    ]
    header = ["part", "compared", *names, *(f"turn, {name}" for name in names)]
    return Section(title="Parts", tables=[Table(header=header, rows=rows, caption="Median errors")])


def _worst(out: Path, placements: Sequence[Placement]) -> Section:
    """The placements that missed by most with the prediction, or with whatever was tried."""
    measured = [one for one in placements if one.translation_error is not None]
    predicted = [one for one in measured if one.correction == "predicted"] or measured
    worst = sorted(predicted, key=lambda one: -(one.translation_error or 0.0))[:WORST]
    rows, pictures = [], []
    for one in worst:
        rows.append(
            [
                Link(text=one.part, to=one.name), one.number, one.slot, one.correction,
                millimetres(one.translation_error), degrees(one.rotation_error), _shift(one.predicted),
                _shift(one.measured),
            ]
        )  # fmt: skip
        path = out / "placements" / f"{one.name}.png"
        pictures.append(Picture(path=path, caption=f"{one.name}: {outcome_text(one)}", name=one.name))
    header = (
        "part",
        "trial",
        "slot",
        "correction",
        "error",
        "turn",
        "predicted in the hand",
        "measured in the hand",
    )
    return Section(
        title=f"The worst {len(worst)}" if worst else "The worst",
        tables=[Table(header=header, rows=rows)] if rows else [],
        pictures=pictures,
    )


def _shift(displacement: list[float] | None) -> str:
    if displacement is None:
        return "-"
    x, y, _, turn = displacement
    return f"({x * 1e3:+.1f}, {y * 1e3:+.1f}) mm, {np.degrees(turn):+.1f} deg"


def _lost(out: Path, placements: Sequence[Placement]) -> Section:
    """What was not placed, or placed and not measured, and why."""
    rows = [
        [one.part, one.number, one.slot, one.correction, one.reason or f"not measured: {one.unmeasured}"]
        for one in placements
        if one.translation_error is None
    ]
    header = ("part", "trial", "slot", "correction", "why")
    return Section(
        title="Not placed or not measured", tables=[Table(header=header, rows=rows)] if rows else []
    )
