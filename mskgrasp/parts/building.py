"""Builds many parts at once, on all cores; what is ready already is left alone."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass

from mskgrasp.cores import one_thread_a_process
from mskgrasp.errors import BadPart
from mskgrasp.parts import store
from mskgrasp.parts.build import build_part, recipe_hash
from mskgrasp.parts.catalogue import Entry, Index, entry_of


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
        BadPart: A worker died.
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
    if len(missing) == 1:
        yield _build_one(missing[0])  # starting a process takes longer than most parts
    elif missing:
        # A process for each core serves better than the threads of CoACD (1.45 times with two).
        with one_thread_a_process():
            yield from _build(missing, max(1, min(workers, len(missing))))


def _ready(name: str, recipe: str) -> Entry | None:
    """The entry of a part that lies ready; its bytes are checked when it is loaded, not here."""
    folder = store.parts_folder() / name
    try:
        entry = entry_of(name)
    except BadPart:
        return None
    complete = all((folder / file).is_file() for file in store.FILES)
    return entry if complete and entry.recipe_hash == recipe else None


def _build(names: Sequence[str], workers: int) -> Generator[Built]:
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, mp_context=context, initializer=_stop_at_once)
    pending: set[Future[Built]] = set()
    todo = iter(names)
    try:
        while True:
            # A short queue: when the user stops, no more than what is being made is waited for.
            while len(pending) < 2 * workers and (name := next(todo, None)) is not None:
                pending.add(pool.submit(_build_one, name))
            if not pending:
                break
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    except BrokenProcessPool as error:
        raise BadPart(
            "a worker died (out of memory?): run the build again, with fewer --workers; "
            "finished parts are kept"
        ) from error
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _stop_at_once() -> None:
    # Ctrl-C reaches the workers, too: one that is deep in a decomposition would not hear it for long, and
    # what it leaves behind is a temporary folder at most.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    threading.Thread(target=_follow_the_parent, daemon=True).start()


def _follow_the_parent() -> None:
    # The workers of a killed pool wait for work for ever: each holds the writing end of the queue, too.
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _build_one(name: str) -> Built:
    started = time.perf_counter()
    try:
        build_part(name)
    except BadPart as error:
        return Built(name=name, entry=None, reason=str(error), seconds=time.perf_counter() - started)
    return Built(name=name, entry=entry_of(name), seconds=time.perf_counter() - started)
