"""Work of the networks on batches, a thread a batch."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import torch

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
