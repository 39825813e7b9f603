"""The verb ``build``: parts are made from their recipes, one by one or the whole catalogue."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass

import tyro

from mskgrasp.core.errors import BadPart, UsageError
from mskgrasp.parts import store
from mskgrasp.parts.build import builtin_names, recipe_of, starter_names
from mskgrasp.parts.catalogue import Index, make_index, read_index, write_index
from mskgrasp.parts.commands.build_parts import Built, build_parts
from mskgrasp.parts.recipes import cad
from mskgrasp.runtime.progress import progress


@dataclass(frozen=True, kw_only=True)
class Build:
    """Build parts: the starter set, those named, or the whole catalogue. What is up to date is left alone.

    A part takes from a fraction of a second to some seconds. A build that is stopped goes on where it was.
    Examples: python -m mskgrasp.parts build hex_nut_m20 washer_m36
    or python -m mskgrasp.parts build --catalogue
    """

    names: tyro.conf.Positional[tuple[str, ...]] = ()
    """Names as `list` shows them; none means the starter set."""
    catalogue: bool = False
    """Build every part there is a recipe for; with the extra [cad] installed there are more."""
    workers: int = 0
    """Processes; 0: one for each core."""


def run_build(verb: Build) -> int:
    """Builds, and keeps the index; returns the exit code."""
    if verb.catalogue and verb.names:
        raise UsageError(f"--catalogue builds all parts, {verb.names[0]!r} among them: give one or the other")
    if verb.workers < 0:
        raise UsageError(f"--workers {verb.workers}: give a number of processes, or 0 for one a core")
    for name in verb.names:
        recipe_of(name)
    names = builtin_names() if verb.catalogue else tuple(dict.fromkeys(verb.names)) or starter_names()
    before = read_index()
    found: dict[str, Built] = {}
    started = time.monotonic()
    try:
        _build(names, before, verb.workers or os.cpu_count() or 1, found)
    finally:
        if verb.catalogue and found:
            # A build that was stopped is remembered as far as it went.
            index = _catalogue(found, before)
            write_index(index)
    fresh = [built for built in found.values() if built.seconds and built.entry is not None]
    refused = [built for built in found.values() if built.entry is None]
    print(
        f"{len(found) - len(refused)} parts ready, {len(fresh)} built now "
        f"({time.monotonic() - started:.0f} s), in {store.parts_folder()}"
    )
    if verb.catalogue:
        _tell(_catalogue(found, before))
    elif refused:
        raise BadPart("; ".join(f"{built.name}: {built.reason}" for built in refused))
    return 0


def _build(names: tuple[str, ...], before: Index, workers: int, found: dict[str, Built]) -> None:
    events = build_parts(names, before, workers)
    with progress(total=len(names), unit="part") as bar:
        try:
            for built in events:
                found[built.name] = built
                bar.set_description(built.name, refresh=False)
                bar.update()
        finally:
            events.close()


def _catalogue(found: dict[str, Built], before: Index) -> Index:
    entries = [built.entry for built in found.values() if built.entry is not None]
    failures = {name: built.reason for name, built in found.items() if built.entry is None}
    return make_index(entries, failures, before)


def _tell(index: Index) -> None:
    for name, left_out in sorted(index.left_out.items()):
        print(f"left out {name}: {left_out.reason.removeprefix(f'{name}: ')}")
    print(f"the catalogue has {len(index.parts)} parts of {len(index.families())} families")
    if not cad.available():
        print("more parts come with the extra [cad]: pip install 'mskgrasp[cad]', then build again")
