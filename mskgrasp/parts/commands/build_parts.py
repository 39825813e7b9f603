"""Builds many parts at once, on all cores; what is ready already is left alone."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from mskgrasp.core.errors import BadPart
from mskgrasp.parts import store
from mskgrasp.parts.build import build_part, recipe_hash
from mskgrasp.parts.catalogue import Entry, Index, entry_of
from mskgrasp.runtime.worker_pool import Work, results


@dataclass(frozen=True, kw_only=True)
class Built:
    """One part is done with.

    Attributes:
        name: Of the part.
        entry: What it has become; None where it could not be built.
        reason: Why it could not be built.
        seconds: How long it took; 0 where it lay ready.
    """

    name: str
    entry: Entry | None
    reason: str = ""
    seconds: float = 0.0


def build_parts(names: Sequence[str], before: Index, workers: int) -> Generator[Built]:
    """Builds parts in the order that they get ready; close the iterator to stop early.

    Args:
        names: Of built-in parts.
        before: The index until now: what it left out is not tried again while its recipe is the same.
        workers: Processes.

    Raises:
        WorkerFailed: A part could not be worked on: three processes died of it, or the disk is full.
        KeyboardInterrupt: The user stopped; a single part's decomposition is finished first, some seconds.
    """
    missing = []
    for name in names:
        recipe = recipe_hash(name)
        old = before.left_out.get(name)
        entry = _ready(name, recipe)
        if entry is not None:
            yield Built(name=name, entry=entry)
        elif old is not None and old.recipe_hash == recipe:
            yield Built(name=name, entry=None, reason=old.reason)
        else:
            missing.append(name)
    # A process for each core serves better than the threads of CoACD (1.45 times with two); starting one
    # takes longer than most parts, so that a single part is built here.
    yield from results(Work(_bench, None), missing, max(1, workers), apart=len(missing) > 1)


def _ready(name: str, recipe: str) -> Entry | None:
    """The entry of a part that lies ready; its bytes are checked when it is loaded, not here."""
    folder = store.parts_folder() / name
    try:
        entry = entry_of(name)
    except BadPart:
        return None
    complete = all((folder / file).is_file() for file in store.FILES)
    return entry if complete and entry.recipe_hash == recipe else None


@contextmanager
def _bench(_: None) -> Iterator[Callable[[str], Iterator[Built]]]:
    yield _build_one


def _build_one(name: str) -> Iterator[Built]:
    started = time.perf_counter()
    try:
        build_part(name)
    except BadPart as error:
        yield Built(name=name, entry=None, reason=str(error), seconds=time.perf_counter() - started)
    else:
        yield Built(name=name, entry=entry_of(name), seconds=time.perf_counter() - started)
