"""Command line of ``python -m mskgrasp.dataset``: check, card, export."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, assert_never

import tyro

from mskgrasp.core.errors import BadDataset
from mskgrasp.core.files import write_whole
from mskgrasp.dataset.card import markdown, read_card, report, tables
from mskgrasp.dataset.check import check_dataset, require_dataset
from mskgrasp.dataset.commands.maniskill import export_maniskill
from mskgrasp.dataset.export import export_npz
from mskgrasp.dataset.labels import export_labels
from mskgrasp.dataset.parquet import CARD, export_parquet
from mskgrasp.reports.console import print_sections
from mskgrasp.reports.section import Section
from mskgrasp.runtime.cli import make_folder
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.options import parse_command
from mskgrasp.runtime.progress import progress

PROG = "python -m mskgrasp.dataset"


@dataclass(frozen=True, kw_only=True)
class CheckCommand:
    """Read all of a dataset and report each shard that is bad, missing or foreign, with the reason.

    Checks: files that are truncated or damaged, types and shapes, values that contradict each other or
    are impossible (a success that moved over 5 cm, depths beyond the table, a grasp outside the region),
    shards that are missing or duplicated, parts and settings that differ between shards. Nothing is changed.
    Exit code 1 if anything is bad. Delete bad files and collect again: only those are made.

    Example: python -m mskgrasp.dataset check data/demo
    """

    folder: tyro.conf.Positional[Path]
    """Folder of the dataset: the --out of mskgrasp.collect."""


@dataclass(frozen=True, kw_only=True)
class CardCommand:
    """Print a dataset's card: attempts, parts, success by family, failures, physics, versions, size.

    Example: python -m mskgrasp.dataset card data/demo --out out/card
    """

    folder: tyro.conf.Positional[Path]
    """Folder of the dataset."""
    out: Path | None = None
    """Folder to write it to, as card.md for people and report.json for programs."""


@dataclass(frozen=True, kw_only=True)
class ExportCommand:
    """Write a dataset for other tools (.npz, Parquet, ManiSkill's .h5 and .json), or its labels alone.

    docs/dataset.md has the layouts. An existing file is not overwritten.

    Example: python -m mskgrasp.dataset export data/demo --format maniskill --out out/demo.h5
    """

    folder: tyro.conf.Positional[Path]
    """Folder of the dataset."""
    format: Literal["npz", "maniskill", "parquet", "labels"]
    """npz: all arrays in one file, for numpy. maniskill: a trajectory an attempt, for ManiSkill's loaders.
    parquet: one file with images and a card beside it, to publish (needs EXTRAS=dev,parquet .ci/setup).
    labels: no images; `mskgrasp.collect --labels` renders them and makes the dataset again."""
    out: Path
    """The file to write, ending in .npz, .h5, .parquet or .labels; with .h5 comes a .json file of the same
    name, with .parquet a README.md."""


VERBS = {"check": CheckCommand, "card": CardCommand, "export": ExportCommand}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb and return the exit code."""
    verb = parse_command(
        VERBS,
        prog=PROG,
        description="Check, summarise and export datasets of mskgrasp.collect.",
        argv=argv,
    )
    match verb:
        case CheckCommand():
            return run_check(verb)
        case CardCommand():
            return run_card(verb)
        case ExportCommand():
            return run_export(verb)
        case _:
            assert_never(verb)


def run_check(verb: CheckCommand) -> int:
    """Print a line for each fault, and a last line with their number."""
    report = check_dataset(verb.folder, _with_progress)
    for note in report.notes:
        print(f"note: {note}", file=sys.stderr)
    for fault in report.faults:
        print(f"{_within(fault.path, verb.folder)}: {fault.reason}")
    read = f"{report.n_shards} shards, {report.n_attempts} attempts"
    bad = {fault.path for fault in report.faults}
    if bad:
        print(f"{verb.folder}: {len(bad)} bad files; {read} read. Delete the bad ones and collect again")
        return 1
    print(f"{verb.folder}: sound, {read}")
    return 0


def run_card(verb: CardCommand) -> int:
    """Print the card, and write it where a folder is given."""
    require_dataset(verb.folder)
    if verb.out is not None:
        make_folder(verb.out)
    try:
        card = read_card(verb.folder, _with_progress)
    except BadDataset as error:
        raise BadDataset(f"{error}; find all bad shards with: {PROG} check {verb.folder}") from error
    print_sections(
        [
            Section(title=title, tables=[Table(header=header, rows=rows)])
            for title, header, rows in tables(card)
        ]
    )
    if verb.out is not None:
        write_whole(verb.out / "card.md", markdown(card).encode())
        write_whole(verb.out / "report.json", (json.dumps(report(card), indent=1) + "\n").encode())
        print(f"wrote {verb.out}/card.md, report.json")
    return 0


def run_export(verb: ExportCommand) -> int:
    """Write the files and print their names."""
    require_dataset(verb.folder)
    if verb.format == "npz":
        n, files = export_npz(verb.folder, verb.out, _with_progress), [verb.out]
    elif verb.format == "parquet":
        n = export_parquet(verb.folder, verb.out, _with_progress)
        files = [verb.out, verb.out.parent / CARD]
    elif verb.format == "labels":
        n, files = export_labels(verb.folder, verb.out, _with_progress), [verb.out]
    else:
        n = export_maniskill(verb.folder, verb.out, _with_progress)
        files = [verb.out, verb.out.with_suffix(".json")]
    print(f"wrote {' and '.join(map(str, files))}: {n} attempts")
    return 0


def _with_progress(paths: Sequence[Path]) -> Iterable[Path]:
    return progress(paths, unit="shard")


def _within(path: Path, folder: Path) -> Path:
    return path.relative_to(folder) if path.is_relative_to(folder) else path
