"""Work of the networks on batches, a thread a batch."""

from __future__ import annotations

import ctypes
import functools
import sys
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import torch

_KEPT_BYTES = 2**28
"""Freed memory that is kept for the next batch: several times what all batches of a plan use at a time."""
_IN_ONE_BLOCK = 2**25
"""Least size of an allocation that is returned whatever is kept: the most that glibc takes."""

Item = TypeVar("Item")
Result = TypeVar("Result")


def map_batches(
    function: Callable[[Item], Result], batches: Iterable[Item], device: torch.device
) -> list[Result]:
    """Apply a function to batches, on a CPU as many at a time as torch has threads, each with one thread.

    Torch would share the threads out within every operation: many are too short for that, sampling an image
    is not shared out at all, and sums are rounded in an order that depends on the number of threads. Here
    results do not.

    Args:
        function: What to compute of a batch.
        batches: The batches, alike in size.
        device: Where it is computed; on a GPU one batch comes after another.
    """
    n_threads = torch.get_num_threads()
    if device.type != "cpu" or n_threads == 1:
        return [function(batch) for batch in batches]
    return list(_threads(n_threads).map(function, batches))


@functools.cache
def _threads(n: int) -> ThreadPoolExecutor:
    """Start threads in each of which torch uses one, once: it takes longer than a batch."""
    _keep_freed_memory()
    started = threading.Barrier(n + 1)

    def start() -> None:
        torch.get_num_threads()  # the first call in a thread would take the default, even after the next
        torch.set_num_threads(1)
        started.wait()

    threads = ThreadPoolExecutor(n, thread_name_prefix="networks")
    for _ in range(n):
        threads.submit(start)
    started.wait()
    torch.set_num_threads(n)  # the last call is the default of every thread that starts later
    return threads


def _keep_freed_memory() -> None:
    """Let glibc keep the memory of one batch for the next, in the whole process; nothing changes elsewhere.

    Otherwise each batch returns its memory to the system and is given it anew, page by page, while the other
    threads wait. The bounds are those of each thread's arena (mallopt(3)).
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if mallopt is not None:
        trim_threshold, top_pad, mmap_threshold = -1, -2, -3  # M_... of malloc.h
        mallopt(trim_threshold, _KEPT_BYTES)
        mallopt(top_pad, _KEPT_BYTES // 4)
        mallopt(mmap_threshold, _IN_ONE_BLOCK)
