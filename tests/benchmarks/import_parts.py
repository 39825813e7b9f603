"""Share of CAD files that become parts, and time. Run: python -m tests.benchmarks.import_parts --help.

Imports the CAD files of a folder (anybody's; `tests.benchmarks.cad_files` exports a set) into a cache folder
of its own, one after the other on one core. Files that are no single watertight body by the reader's own
repair are listed and not counted. ``--speed-up N`` imports them again with N processes, as a user does,
compares the wall time, and checks that the parts are the same to the last byte.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast, get_args

import numpy as np

from mskgrasp.core.errors import BadPart
from mskgrasp.core.units import Unit
from mskgrasp.parts import Part, store
from mskgrasp.parts.commands.import_files import ImportOptions, import_files
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.progress import note, progress
from tests.benchmarks.report import show


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """One watertight file: its part, or the reason why there is none, and seconds: processor's and wall."""

    path: Path
    part: Part | None
    reason: str
    seconds: float
    wall: float


def main() -> None:
    """Print a row a file, and a summary."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        prog="tests.benchmarks.import_parts",
    )
    parser.add_argument("folder", type=Path, help="folder of CAD files; its subfolders are left out")
    parser.add_argument("--unit", choices=get_args(Unit), help="unit of STL, OBJ and PLY (default mm)")
    parser.add_argument("--every", type=int, default=1, help="import every n-th file only (default 1)")
    parser.add_argument(
        "--speed-up", type=int, default=0, metavar="N", help="import them with N processes, too"
    )
    parser.add_argument("--out", type=Path, help="folder for report.json")
    options = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = "1"
    unit = cast("Unit | None", options.unit)
    with tempfile.TemporaryDirectory() as folder:
        outcomes, no_bodies = measure(options.folder, unit, Path(folder), options.every)
        alone = _contents(Path(folder))
    if not any(one.part for one in outcomes):
        parser.error(
            f"no file of {options.folder} becomes a part: {'; '.join(no_bodies[:3]) or 'none found'}"
        )
    tables = [_summary(outcomes, no_bodies), _files(outcomes)]
    if options.speed_up:
        tables.insert(1, _speed_up(outcomes, alone, unit, options.speed_up))
    n = f"{len(outcomes)} watertight files; {len(no_bodies)} others were not counted"
    show(tables, options.out, {"n": n})


def measure(folder: Path, unit: Unit | None, cache: Path, every: int = 1) -> tuple[list[Outcome], list[str]]:
    """Import the files of a folder one by one into an empty cache.

    Returns:
        Outcomes of the watertight files, and a line for each of the others.
    """
    # Loaded before the clock starts; a user's import of many files loads it once, too.
    from mskgrasp.parts.importing.import_file import import_file
    from mskgrasp.parts.importing.select_files import select_files
    from mskgrasp.parts.solids.one_thread import hold_manifold_to_one_thread

    hold_manifold_to_one_thread()  # as an import does, before the files are looked at

    outcomes: list[Outcome] = []
    others: list[str] = []
    with store.kept_in(cache):
        for path in progress(select_files([folder]).files[::every], unit="file"):
            reason = _no_body(path, unit)
            if reason:
                others.append(reason)
                continue
            start, began = time.process_time(), time.perf_counter()
            part, reason = None, ""
            try:
                part = import_file(path, unit=unit).parts[0]
            except BadPart as error:
                reason = str(error)
            seconds, wall = time.process_time() - start, time.perf_counter() - began
            one = Outcome(path=path, part=part, reason=reason, seconds=seconds, wall=wall)
            outcomes.append(one)
            note(", ".join(str(cell) for cell in _row(one)))
    return outcomes, others


def _no_body(path: Path, unit: Unit | None) -> str:
    """Why a file is no single watertight body of a possible size; empty where it is."""
    from mskgrasp.parts.importing.bodies import repair_bodies
    from mskgrasp.parts.importing.mesh_files import read_content, read_mesh

    try:
        repair_bodies(read_mesh(path, read_content(path), unit).objects, bodies="one")
    except BadPart as error:
        return f"{path.name} {error}" if path.name not in str(error) else str(error)
    return ""


def _files(outcomes: Sequence[Outcome]) -> Table:
    header = ("file", "grade", "hulls", "error p95 mm", "volume", "processor s")
    return Table(header=header, rows=[_row(one) for one in outcomes], caption="Files")


def _row(one: Outcome) -> tuple[object, ...]:
    seconds = f"{one.seconds:.1f}"
    if one.part is None:
        return (one.path.name, "refused", "", one.reason, "", seconds)
    p95, volume = f"{1e3 * one.part.hull_error_p95:.2f}", f"{one.part.hull_volume_ratio:.3f}"
    return (one.path.name, one.part.grade, one.part.n_hulls, p95, volume, seconds)


def _summary(outcomes: Sequence[Outcome], others: Sequence[str]) -> Table:
    parts = [one.part for one in outcomes if one.part is not None]
    fine = [part for part in parts if part.grade == "fine"]
    seconds = np.array([one.seconds for one in outcomes])
    errors = 1e3 * np.array([part.hull_error_p95 for part in parts])
    hulls = np.array([part.n_hulls for part in parts])
    count = max(1, len(outcomes))
    rows = [
        ("watertight files", f"{len(outcomes)} ({len(others)} others)"),
        ("become parts", f"{len(parts)} ({len(parts) / count:.1%})"),
        ("fine", f"{len(fine)} ({len(fine) / count:.1%})"),
        ("coarse", f"{len(parts) - len(fine)}"),
        ("error p95 mm, median and largest", f"{np.median(errors):.2f}, {errors.max():.2f}"),
        ("hulls, median and largest", f"{np.median(hulls):.0f}, {hulls.max()}"),
        ("processor s a file, median", f"{np.median(seconds):.1f}"),
        ("processor s a file, 90 %", f"{np.quantile(seconds, 0.9):.1f}"),
        ("processor s, all", f"{seconds.sum():.0f}"),
    ]
    rows += [("not counted", line) for line in others]
    return Table(header=("of all files", ""), rows=rows, caption="All files")


def _speed_up(outcomes: Sequence[Outcome], alone: dict[str, bytes], unit: Unit | None, workers: int) -> Table:
    """Wall time of one process and of several, their start included; the parts' bytes are compared."""
    with tempfile.TemporaryDirectory() as cache, store.kept_in(Path(cache)):
        start = time.perf_counter()
        results = import_files([one.path for one in outcomes], _options(unit), workers)
        for _ in progress(results, unit="file", total=len(outcomes), title=f"{workers} processes"):
            pass
        together = time.perf_counter() - start
        same = "yes" if _contents(Path(cache)) == alone else "no"
    one = sum(outcome.wall for outcome in outcomes)
    rows = [
        ("1 process, s", f"{one:.0f}"),
        (f"{workers} processes, s", f"{together:.0f}"),
        (f"{workers} processes, s a file", f"{together / len(outcomes):.1f}"),
        ("speed-up", f"{one / together:.2f}"),
        ("the same bytes", same),
    ]
    return Table(header=("wall time", ""), rows=rows, caption="One process and several")


def _contents(cache: Path) -> dict[str, bytes]:
    return {str(path.relative_to(cache)): path.read_bytes() for path in cache.rglob("*.*") if path.is_file()}


def _options(unit: Unit | None) -> ImportOptions:
    return ImportOptions(
        name=None, family="imported", unit=unit, density=7850.0, licence="NOASSERTION", bodies="one"
    )


if __name__ == "__main__":
    main()
