"""Commands that draw: ``show`` one part, ``sheet`` of the whole catalogue."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import tyro

from mskgrasp.core.errors import BadPart, UsageError
from mskgrasp.parts.builtin import find_part
from mskgrasp.parts.catalogue import read_index, require_name
from mskgrasp.parts.commands.grade import coarse_note, grade_text
from mskgrasp.runtime.progress import advance_to, progress
from mskgrasp.simulation.resting import Resting, resting_of

PICTURE_SUFFIXES = (".png", ".svg", ".pdf")


@dataclass(frozen=True, kw_only=True)
class Show:
    """Draw a part: its mesh, its collision hulls moved apart, and its stable poses on a table.

    Prints which resting poses do not stand in the physics engine; attempts leave these out.

    Example: python -m mskgrasp.parts show spur_gear_m2_z18 --out gear.png
    """

    name: tyro.conf.Positional[str]
    """A part's name, or the path of a part folder."""
    out: Path | None = None
    """Picture to write, .png, .svg or .pdf; by default NAME.png in the current folder."""


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """Draw a contact sheet of the catalogue: some parts of every family, coloured by material.

    Example: python -m mskgrasp.parts sheet --out sheet.png
    """

    out: Path = Path("sheet.png")
    """Picture to write, .png, .svg or .pdf."""
    parts: int = 192
    """Approximate number of parts; every family is drawn at least once."""


def run_show(command: Show) -> int:
    """Write the picture of a part."""
    # Matplotlib takes a second to load; the other commands do not need it.
    from mskgrasp.parts.figures.picture import draw_part

    require_name(command.name)
    part = find_part(command.name)
    out = command.out or Path(f"{part.name}.png")
    _check(out)
    draw_part(part, out)
    print(out)
    print(f"hulls: {part.n_hulls}, {grade_text(part)}")
    coarse = coarse_note([part])
    if coarse is not None:
        print(coarse)
    print(resting_text(resting_of(part)))
    return 0


def resting_text(resting: Resting) -> str:
    """How many resting poses stand in the engine, and which do not, counted from 0 as in part.json."""
    n = len(resting.stands)
    fallen = [k for k, stands in enumerate(resting.stands) if not stands]
    if not fallen:
        return f"resting poses: all {n} stand in the engine"
    named = ", ".join(f"pose {k} ({resting.probability[k]:.2%})" for k in fallen)
    if len(fallen) == n:
        return f"resting poses: none of {n} stands in the engine, so the part cannot be simulated: {named}"
    return (
        f"resting poses: {n - len(fallen)} of {n} stand in the engine; "
        f"left out, with {resting.toppled:.2%} of the probability: {named}"
    )


def run_sheet(command: Sheet) -> int:
    """Write the contact sheet."""
    from mskgrasp.parts.figures.sheet import draw_sheet

    _check(command.out)
    if command.parts < 1:
        raise UsageError(f"--parts {command.parts}: give at least 1")
    index = read_index()
    if not index.parts:
        raise BadPart("the catalogue is not built yet: python -m mskgrasp.parts build --catalogue")
    with progress(title="sheet", unit="part") as bar:
        draw_sheet(index, command.out, command.parts, partial(advance_to, bar))
    print(command.out)
    return 0


def _check(out: Path) -> None:
    if out.suffix.lower() not in PICTURE_SUFFIXES:
        raise UsageError(f"--out {out}: the suffix must be one of {', '.join(PICTURE_SUFFIXES)}")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"--out {out}: cannot make folder {out.parent} ({error.strerror}): choose another folder"
        ) from error
