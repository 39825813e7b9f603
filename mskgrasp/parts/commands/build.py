"""Command ``build``: parts from their recipes, by name or the whole catalogue."""

from __future__ import annotations

import time
from dataclasses import dataclass

import tyro

from mskgrasp.core.errors import BadPart, UsageError
from mskgrasp.parts import store
from mskgrasp.parts.builtin import builtin_names, recipe_hash, recipe_of, starter_names
from mskgrasp.parts.catalogue import Index, make_index, read_index, write_index
from mskgrasp.parts.commands.build_parts import BuildResult, build_parts
from mskgrasp.parts.recipes import cad
from mskgrasp.runtime.progress import progress
from mskgrasp.runtime.worker_pool import process_count


@dataclass(frozen=True, kw_only=True)
class Build:
    """Build parts: the starter set, those named, or the whole catalogue. Parts that are up to date are kept.

    A part takes from a fraction of a second to several seconds. A build that was stopped can be resumed.
    Examples: python -m mskgrasp.parts build hex_nut_m20 washer_m36
    or python -m mskgrasp.parts build --catalogue
    """

    names: tyro.conf.Positional[tuple[str, ...]] = ()
    """Names as `list` shows them; none means the starter set."""
    catalogue: bool = False
    """Build every part with a recipe; the extra [cad] adds more."""
    workers: int = 0
    """Number of processes; 0: one for each core."""


def run_build(command: Build) -> int:
    """Build the parts and update the index; return the exit code."""
    if command.catalogue and command.names:
        raise UsageError(
            f"--catalogue builds all parts, {command.names[0]!r} among them: give one or the other"
        )
    if command.workers < 0:
        raise UsageError(
            f"--workers {command.workers}: give a number of processes, or 0 for one for each core"
        )
    for name in command.names:
        recipe_of(name)
    names = builtin_names() if command.catalogue else tuple(dict.fromkeys(command.names)) or starter_names()
    before = read_index()
    found: dict[str, BuildResult] = {}
    started = time.monotonic()
    try:
        _build(names, before, process_count(command.workers), found)
    finally:
        if command.catalogue and found:
            write_index(_catalogue(names, found, before))
    fresh = [built for built in found.values() if built.seconds and built.entry is not None]
    refused = [built for built in found.values() if built.entry is None]
    print(
        f"{len(found) - len(refused)} parts ready, {len(fresh)} built now "
        f"({time.monotonic() - started:.0f} s), in {store.parts_folder()}"
    )
    if command.catalogue:
        _print_summary(_catalogue(names, found, before))
    elif refused:
        raise BadPart("; ".join(f"{built.name}: {built.reason}" for built in refused))
    return 0


def _build(names: tuple[str, ...], before: Index, workers: int, found: dict[str, BuildResult]) -> None:
    events = build_parts(names, before, workers)
    with progress(total=len(names), unit="part") as bar:
        try:
            for built in events:
                found[built.name] = built
                bar.set_description(built.name, refresh=False)
                bar.update()
        finally:
            events.close()


def _catalogue(names: tuple[str, ...], found: dict[str, BuildResult], before: Index) -> Index:
    """The index of the results so far; parts that a stopped build did not reach stay as they were."""
    entries = [built.entry for built in found.values() if built.entry is not None]
    failures = {name: built.reason for name, built in found.items() if built.entry is None}
    for name in names:
        if name in found:
            continue
        old = before.left_out.get(name)
        if name in before.parts:
            entries.append(before.parts[name])
        elif old is not None and old.recipe_hash == recipe_hash(name):
            failures[name] = old.reason
    return make_index(entries, failures, before)


def _print_summary(index: Index) -> None:
    for name, left_out in sorted(index.left_out.items()):
        print(f"left out {name}: {left_out.reason.removeprefix(f'{name}: ')}")
    print(f"the catalogue has {len(index.parts)} parts of {len(index.families())} families")
    if not cad.available():
        print("more parts come with the extra [cad]: run EXTRAS=dev,cad .ci/setup, then build again")
