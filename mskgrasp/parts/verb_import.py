"""The verb ``import``: mesh files become parts."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from mskgrasp.errors import BadPart, MskgraspError, UsageError
from mskgrasp.parts import store
from mskgrasp.parts.part import Part
from mskgrasp.parts.terminal import progress_bar

USUAL_SIZE_M = (0.02, 0.15)


@dataclass(frozen=True, kw_only=True)
class Import:
    """Make parts of mesh files (STL, OBJ, PLY).

    A mesh must be a closed single body; the hulls come from CoACD, which takes from a second to a minute a
    part. A file that is refused is explained in one line, the others are imported all the same.
    Example: python -m mskgrasp.parts import clamp.stl --unit mm --density 2700
    """

    files: tyro.conf.Positional[tuple[Path, ...]]
    """Mesh files: .stl, .obj or .ply."""
    unit: Literal["mm", "m", "in"] = "mm"
    """Unit of the files' coordinates; mesh files do not say it."""
    density: float = 7850.0
    """kg/m^3: steel 7850, aluminium 2700, brass 8500, ABS 1050."""
    name: str | None = None
    """Name of the part; by default the file's name in lower case. Only with a single file."""
    family: str = "imported"
    """Kind of part, for grouping in reports."""
    licence: str = "NOASSERTION"
    """SPDX identifier of the mesh's licence, for example CC-BY-4.0."""


def run_import(verb: Import) -> int:
    """Imports the files one by one; returns the exit code: 0, or 1 where a file was refused."""
    # CoACD is loaded here alone, so that the other verbs start without it.
    from mskgrasp.parts.importing import import_part, legal_name

    if not verb.files:
        raise UsageError("no file given: python -m mskgrasp.parts import FILE...")
    if verb.name is not None and len(verb.files) > 1:
        raise UsageError(
            f"--name {verb.name} with {len(verb.files)} files: import them one by one to name them"
        )
    refused = 0
    taken: dict[str, Path] = {}
    with progress_bar() as progress:
        task = progress.add_task("", total=len(verb.files))
        for path in verb.files:
            progress.update(task, description=path.name)
            try:
                name = legal_name(path.stem if verb.name is None else verb.name)
                if name in taken:
                    raise BadPart(
                        f"{path} would replace the part {name!r} of {taken[name]}: import it with --name"
                    )
                part = import_part(
                    path,
                    name=name,
                    family=verb.family,
                    unit=verb.unit,
                    density=verb.density,
                    licence=verb.licence,
                )
                taken[name] = path
                print(_imported(part))
                if not USUAL_SIZE_M[0] <= part.longest_axis <= USUAL_SIZE_M[1]:
                    print(_odd_size(part, verb.unit), file=sys.stderr)
            except MskgraspError as error:
                refused += 1
                print(f"error: {error}", file=sys.stderr)
            progress.advance(task)
    print(f"{len(verb.files) - refused} of {len(verb.files)} files are parts now, in {store.parts_folder()}")
    return 1 if refused else 0


def _imported(part: Part) -> str:
    hulls = "1 hull" if part.n_hulls == 1 else f"{part.n_hulls} hulls"
    return (
        f"{part.name}: {1e3 * part.longest_axis:.1f} mm, {1e3 * part.mass:.3g} g, {hulls}, "
        f"hull error {1e3 * part.hull_error:.2f} mm"
    )


def _odd_size(part: Part, unit: str) -> str:
    return (
        f"warning: {part.name} is {1e3 * part.longest_axis:.4g} mm long; the cell is made for parts of "
        f"{1e3 * USUAL_SIZE_M[0]:.0f} to {1e3 * USUAL_SIZE_M[1]:.0f} mm: is --unit {unit} right?"
    )
