"""Command ``list``: tables of parts."""

from __future__ import annotations

import csv
import difflib
import errno
import io
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mskgrasp.core.errors import BadPart, UsageError, shown
from mskgrasp.core.files import write_whole
from mskgrasp.parts import store
from mskgrasp.parts.builtin import imported_names, is_built, starter_names
from mskgrasp.parts.catalogue import THIN, Entry, Index, read_index
from mskgrasp.parts.names import SPLITS
from mskgrasp.runtime.console_table import Table, print_table


@dataclass(frozen=True, kw_only=True)
class List:
    """List parts: the starter set and imported ones, with size, mass and quality of the hulls.

    With --catalogue: a summary of each family of the catalogue; with --family NAME: the parts of one family.
    """

    catalogue: bool = False
    """Summarise the catalogue by family."""
    family: str | None = None
    """List each part of this family of the catalogue."""
    csv: Path | None = None
    """Write the catalogue to this file, one row for each part."""


def run_list(command: List) -> int:
    """Print a table, with the number of parts in the last line."""
    if command.csv is not None:
        _write(_built_index(), command.csv)
        print(command.csv)
    if command.family is not None:
        index = _built_index()
        entries = [entry for entry in index.parts.values() if entry.family == command.family]
        if not entries:
            known = sorted(index.families())
            similar = difflib.get_close_matches(command.family, known, n=5, cutoff=0.5) or known[:10]
            more = "" if len(similar) == len(known) else "; `list --catalogue` shows all"
            raise UsageError(f"no family {shown(command.family)}: give one of {', '.join(similar)}{more}")
        print_table(_entry_table(entries))
        print(f"{len(entries)} parts")
    elif command.catalogue or command.csv is not None:
        index = _built_index()
        print_table(_family_table(index))
        _print_spread(index)
        print(f"{len(index.parts)} parts")
    else:
        names = sorted((*starter_names(), *imported_names()))
        header = (
            "name", "family", "source", "longest axis mm", "mass g", "hulls", "grade", "error p95 mm",
            "max mm", "poses",
        )  # fmt: skip
        print_table(Table(header=header, rows=[(name, *_row(name)) for name in names]))
        print(f"{len(names)} parts")
    return 0


def write_csv(index: Index, path: Path) -> None:
    """Write the catalogue atomically as CSV, one row for each part, sorted by name.

    Raises:
        OSError: The disk is full or not writable.
    """
    columns = (
        "name", "family", "source", "licence", "split", "group", "longest_axis_mm", "edge_1_mm", "edge_2_mm",
        "edge_3_mm", "volume_cm3", "mass_g", "hulls", "hull_error_p95_mm", "hull_error_largest_mm",
        "hull_volume_ratio", "attempts", "successes",
    )  # fmt: skip
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for name, e in sorted(index.parts.items()):
        writer.writerow([
            name, e.family, e.source, e.licence, e.split, e.group,
            *(f"{1e3 * length:.2f}" for length in (e.longest_axis, *e.extents)),
            f"{1e6 * e.volume:.3f}", f"{1e3 * e.mass:.1f}", e.n_hulls, f"{1e3 * e.hull_error_p95:.2f}",
            f"{1e3 * e.hull_error:.2f}", f"{e.hull_volume_ratio:.3f}",
            *((e.rating.attempts, e.rating.successes) if e.rating else ("", "")),
        ])  # fmt: skip
    write_whole(path, text.getvalue().encode())


def _write(index: Index, path: Path) -> None:
    """Write the CSV file that the user names.

    Raises:
        UsageError: There can be no file.
    """
    if path.exists() and not path.is_file():
        raise UsageError(f"--csv {path} is no file: choose another path")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_csv(index, path)
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise
        raise UsageError(
            f"--csv {path}: cannot be written ({error.strerror}): choose another path"
        ) from error


def _built_index() -> Index:
    index = read_index()
    if not index.parts:
        raise BadPart("the catalogue is not built yet: python -m mskgrasp.parts build --catalogue")
    return index


def _row(name: str) -> tuple[str, ...]:
    if name in starter_names() and not is_built(name):
        return ("(not built yet)", *8 * ("",))
    try:
        part = store.read_part(store.parts_folder() / name)
    except BadPart:
        return ("(damaged: import it again)", *8 * ("",))
    return (
        part.family,
        part.source,
        f"{1e3 * part.longest_axis:.1f}",
        f"{1e3 * part.mass:.3g}",
        str(part.n_hulls),
        part.grade,
        f"{1e3 * part.hull_error_p95:.2f}",
        f"{1e3 * part.hull_error:.2f}",
        str(len(part.resting_probability)),
    )


def _entry_table(entries: Iterable[Entry]) -> Table:
    header = (
        "name", "source", "split", "edges mm", "mass g", "hulls", "hull error mm, 95 %", "largest", "volume",
        "random grasps",
    )  # fmt: skip
    rows = []
    for entry in entries:
        rating = entry.rating
        low, high = rating.interval if rating else (0.0, 1.0)
        rows.append(
            (
                entry.name,
                entry.source,
                entry.split,
                " x ".join(f"{1e3 * edge:.4g}" for edge in entry.extents[::-1]),
                f"{1e3 * entry.mass:.3g}",
                str(entry.n_hulls),
                f"{1e3 * entry.hull_error_p95:.2f}",
                f"{1e3 * entry.hull_error:.2f}",
                f"{100 * entry.hull_volume_ratio - 100:+z.1f} %",
                f"{rating.rate:.0%} ({low:.0%} - {high:.0%})" if rating else "not rated",
            )
        )
    return Table(header=header, rows=rows)


def _family_table(index: Index) -> Table:
    header = (
        "family", "parts", "longest axis mm", "hulls median", "largest hull error mm, 95 %", *SPLITS,
        "random grasps",
    )  # fmt: skip
    rows = []
    for family in sorted(index.families()):
        entries = [entry for entry in index.parts.values() if entry.family == family]
        length = [1e3 * entry.longest_axis for entry in entries]
        sides = Counter(entry.split for entry in entries)
        rated = [entry.rating for entry in entries if entry.rating is not None]
        rate = sum(r.successes for r in rated) / max(1, sum(r.attempts for r in rated))
        rows.append(
            (
                family,
                str(len(entries)),
                f"{min(length):.0f} - {max(length):.0f}",
                f"{np.median([entry.n_hulls for entry in entries]):.0f}",
                f"{1e3 * max(entry.hull_error_p95 for entry in entries):.2f}",
                *(str(sides[side]) for side in SPLITS),
                f"{rate:.0%} ({len(rated)} rated)" if rated else "not rated",
            )
        )
    return Table(header=header, rows=rows)


def _print_spread(index: Index) -> None:
    entries = list(index.parts.values())
    length = np.array([1e3 * entry.longest_axis for entry in entries])
    edges = np.array([20, 40, 60, 80, 100, 120, 150.001])
    counts, _ = np.histogram(length, edges)
    spread = ", ".join(f"{a:.0f}-{b:.0f} mm {n}" for a, b, n in zip(edges, edges[1:], counts, strict=False))
    print(f"longest axis: {spread}")
    sides = Counter(entry.split for entry in entries)
    print("split: " + ", ".join(f"{side} {sides[side]}" for side in SPLITS))
    family, most = index.families().most_common(1)[0]
    thin = sum(entry.extents[0] < THIN for entry in entries)
    print(
        f"largest family: {family}, {most / len(entries):.1%}; thinner than {1e3 * THIN:.0f} mm: "
        f"{thin / len(entries):.1%}; left out: {len(index.left_out)}"
    )
