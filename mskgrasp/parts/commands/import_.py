"""Command ``import``: parts from CAD files."""

from __future__ import annotations

import sys
from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro
from rich.console import Console
from rich.text import Text

from mskgrasp.core.errors import BadPart, UsageError
from mskgrasp.core.panda_body import HAND_MASS, PAYLOAD
from mskgrasp.parts import store
from mskgrasp.parts.commands.grade import coarse_note
from mskgrasp.parts.commands.import_files import FileResult, ImportOptions, import_files
from mskgrasp.parts.part import Part
from mskgrasp.runtime.console_table import Table, print_table, report_console
from mskgrasp.runtime.progress import note, progress
from mskgrasp.runtime.worker_pool import process_count

if TYPE_CHECKING:
    from mskgrasp.parts.importing.import_file import Imported

_FLAG = tyro.conf.FlagCreatePairsOff

_TABLE_WIDTH = 130
_COLOURS = {"imported": "green", "repaired": "yellow", "refused": "red", "unchanged": "dim"}


@dataclass(frozen=True, kw_only=True)
class Import:
    """Make parts of CAD files: STL, OBJ, PLY, GLB, 3MF, STEP.

    Takes files, folders and quoted patterns such as 'cad/**/*.stl'. Defects that can be repaired safely are
    repaired; a file with others is refused with the reason, and the remaining files are still imported. A
    table at the end lists the result of each file, with the grade of its hulls: fine, or coarse, which the
    collector leaves out. A file takes seconds; several are imported on all cores.
    Example: python -m mskgrasp.parts import clamp.stl cad/ --density 2700
    """

    files: tyro.conf.Positional[tuple[Path, ...]]
    """Files (.stl .obj .ply .glb .3mf .step .stp), folders, quoted patterns."""
    unit: Literal["mm", "m", "in"] | None = None
    """Unit of STL, OBJ and PLY (else mm), and of a GLB not in metres; 3MF and STEP state theirs."""
    density: float = 7850.0
    """kg/m^3: steel 7850, aluminium 2700, brass 8500, ABS 1050."""
    split: Annotated[bool, _FLAG] = False
    """Import each body of a file as a part: NAME-1, NAME-2, ... by decreasing volume."""
    union: Annotated[bool, _FLAG] = False
    """Join the bodies of a file that touch or overlap into one part."""
    name: str | None = None
    """Name of the part, for a single file; by default the file's name in lower case."""
    family: str = "imported"
    """Kind of part, for grouping in reports."""
    licence: str = "NOASSERTION"
    """SPDX identifier of the files' licence, for example CC-BY-4.0."""
    workers: int = 0
    """Number of processes; 0: one for each core."""


@dataclass(frozen=True, kw_only=True)
class _Row:
    file: str
    result: str
    parts: tuple[Part, ...] = ()
    remarks: tuple[str, ...] = ()


def run_import(command: Import) -> int:
    """Import the files; return the exit code: 0, or 1 where a file was refused.

    Raises:
        UsageError: There is nothing to import, or the options contradict each other.
    """
    # The readers are loaded only here, so that the other commands start faster.
    from mskgrasp.parts.importing.import_file import check_density
    from mskgrasp.parts.importing.select_files import select_files

    if command.split and command.union:
        raise UsageError("--split and --union exclude each other: choose one")
    try:
        check_density(command.density)
    except BadPart as error:
        raise UsageError(f"--density: {error}") from error
    if command.workers < 0:
        raise UsageError(
            f"--workers {command.workers}: give a number of processes, or 0 for one for each core"
        )
    selected = select_files(command.files)
    if not selected.files and all(path in command.files for path, _ in selected.refused):
        reason = selected.refused[0][1] if selected.refused else "no file given"
        raise UsageError(f"{reason} (python -m mskgrasp.parts import FILE, FOLDER or 'PATTERN')")
    if command.name is not None and len(selected.files) > 1:
        raise UsageError(
            f"--name {command.name} with {len(selected.files)} files: import them one by one to name them"
        )
    rows: list[_Row] = []
    for path, why in selected.refused:
        rows.append(_Row(file=str(path), result="refused", remarks=(_without(why, path),)))
        note(f"error: {why}")
    found: dict[Path, FileResult] = {}
    try:
        for result in _import_all(command, selected.files):
            found[result.path] = result
    finally:  # also when stopped: finished files are listed
        rows += [_row(found[path]) for path in selected.files if path in found]
        if rows:
            _print_table(rows)
    if selected.skipped:
        note(f"skipped {_listed(selected.skipped)}: not CAD files by their suffix")
    good = sum(row.result != "refused" for row in rows)
    print(f"{good} of {len(rows)} files imported, in {store.parts_folder()}")
    coarse = coarse_note(part for row in rows for part in row.parts)
    if coarse is not None:
        print(coarse, file=sys.stderr)
    return 0 if good == len(rows) else 1


def _import_all(command: Import, files: Sequence[Path]) -> Generator[FileResult]:
    """Import the files on all cores, with a progress bar and a line for each warning and refusal."""
    options = ImportOptions(
        name=command.name,
        family=command.family,
        unit=command.unit,
        density=command.density,
        licence=command.licence,
        bodies="split" if command.split else "union" if command.union else "one",
    )
    events = import_files(files, options, process_count(command.workers))
    with progress(total=len(files), unit="file") as bar, closing(events):
        for result in events:
            bar.set_description(result.path.name, refresh=False)
            if result.imported is None:
                note(f"error: {result.reason}")
            else:
                for part in result.imported.parts:
                    for warning in _warnings(part, result.imported):
                        note(f"warning: {warning}")
            yield result
            bar.update()


def _row(result: FileResult) -> _Row:
    imported, file = result.imported, str(result.path)
    if imported is None:
        return _Row(file=file, result="refused", remarks=(_without(result.reason, result.path),))
    if imported.unchanged:
        return _Row(file=file, result="unchanged", parts=imported.parts, remarks=("up to date",))
    remarks = imported.notes
    if result.replaced:
        remarks = (*remarks, "replaced the part of that name")
    return _Row(
        file=file,
        result="repaired" if imported.notes else "imported",
        parts=imported.parts,
        remarks=remarks,
    )


def _without(message: str, path: Path) -> str:
    """The reason of a refusal without the file's name, which is in the first column."""
    return message.removeprefix(str(path)).removeprefix(":").strip()


def _warnings(part: Part, imported: Imported) -> list[str]:
    from mskgrasp.core.units import MILLIMETRES
    from mskgrasp.parts.importing.mesh_files import USUAL_SIZE_MM, size_hint
    from mskgrasp.parts.solids.mesh_pieces import MOST_OPENING_MM

    found = []
    longest = 1e3 * part.longest_axis
    if not USUAL_SIZE_MM[0] <= longest <= USUAL_SIZE_MM[1]:
        unit = imported.unit
        may_choose = unit in MILLIMETRES and not imported.states_unit
        hint = f" ({size_hint(longest, unit, MILLIMETRES[unit])})" if may_choose else ""
        found.append(
            f"{part.name} is {longest:.4g} mm long; the usual size is "
            f"{USUAL_SIZE_MM[0]:.0f} to {USUAL_SIZE_MM[1]:.0f} mm: is the unit right?{hint}"
        )
    beyond = 1e3 * store.read_record(part.folder)["hull_outward"]["largest"]
    if beyond > MOST_OPENING_MM + 1:  # pieces overlap by 1 mm
        found.append(
            f"the hulls of {part.name} reach up to {beyond:.1f} mm from its surface where it is open: in "
            "simulation no finger can enter there"
        )
    carried = PAYLOAD - HAND_MASS
    if part.mass > carried:
        found.append(
            f"{part.name} weighs {part.mass:.3g} kg, the arm carries {carried:.3g} kg: is --density right?"
        )
    return found


def _print_table(rows: Sequence[_Row]) -> None:
    console = report_console()
    if console.is_terminal and console.width < _TABLE_WIDTH:
        for row in rows:
            _print_lines(console, row)
        return
    header = (
        "file", "part", "result", "size mm", "mass g", "hulls", "grade", "error p95 mm", "max mm",
        "repairs, or reason of refusal",
    )  # fmt: skip
    cells: list[tuple[object, ...]] = []
    for row in rows:
        of_file = (row.file, Text(row.result, style=_COLOURS[row.result]), "; ".join(row.remarks))
        for part in row.parts:
            file, result, remarks = of_file
            cells.append((file, part.name, result, *_figures(part), remarks))
            of_file = ("", "", "")
        if not row.parts:
            file, result, remarks = of_file
            cells.append((file, "", result, *6 * ("",), remarks))
    print_table(Table(header=header, rows=cells))


def _print_lines(console: Console, row: _Row) -> None:
    """The content of the table as lines, for narrow terminals."""
    head = Text.assemble((row.file, "bold"), ": ", (row.result, _COLOURS[row.result]))
    console.print(head.append("".join(f"; {remark}" for remark in row.remarks)))
    for part in row.parts:
        size, mass, hulls, grade, p95, largest = _figures(part)
        figures = f"{size} mm, {mass} g, hulls {hulls}, {grade}, error p95 {p95} mm, max {largest} mm"
        console.print(Text(f"  {part.name}: {figures}"))


def _figures(part: Part) -> tuple[str, ...]:
    return (
        " x ".join(f"{1e3 * size:.1f}" for size in part.extents),
        f"{1e3 * part.mass:.3g}",
        str(part.n_hulls),
        part.grade,
        f"{1e3 * part.hull_error_p95:.2f}",
        f"{1e3 * part.hull_error:.2f}",
    )


def _listed(paths: Sequence[Path]) -> str:
    names = ", ".join(path.name for path in paths[:3])
    return names + (f" and {len(paths) - 3} more" if len(paths) > 3 else "")
