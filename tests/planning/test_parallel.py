"""Work of the networks on batches, a thread a batch."""

from __future__ import annotations

import subprocess
import sys
import threading

import pytest
import torch

from mskgrasp.planning.parallel import map_batches
from tests.planning.threads import torch_threads

CPU = torch.device("cpu")


def test_each_thread_of_torchs_number_works_with_one():
    with torch_threads(2):
        both = threading.Barrier(2, timeout=10)

        def work(batch: int) -> tuple[int, int, str]:
            both.wait()  # passes only if two are at work
            return batch, torch.get_num_threads(), threading.current_thread().name

        found = map_batches(work, range(4), CPU)
        assert [batch for batch, _, _ in found] == [0, 1, 2, 3]
        assert {n for _, n, _ in found} == {1}
        assert len({name for _, _, name in found}) == 2
        assert torch.get_num_threads() == 2
        later: list[int] = []
        thread = threading.Thread(target=lambda: later.append(torch.get_num_threads()))
        thread.start()
        thread.join()
        assert later == [2]


def test_one_thread_works_in_the_callers():
    with torch_threads(1):
        found = map_batches(lambda _: threading.current_thread(), range(2), CPU)
    assert found == [threading.current_thread()] * 2


_PAGE_FAULTS = """
import resource
import threading
import torch
from mskgrasp.planning.parallel import map_batches

torch.set_num_threads(2)
both = threading.Barrier(2)

def work(batch):
    both.wait()  # both threads work on half of the batches
    held = [torch.ones(2**20) for _ in range(8)]

before = []
for _ in range(3):
    before.append(resource.getrusage(resource.RUSAGE_SELF).ru_minflt)
    map_batches(work, range(8), torch.device("cpu"))
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before[-1])
"""
"""Prints the page faults of 8 batches that hold 8 times 4 MiB each, after the first ones."""


@pytest.mark.skipif(sys.platform != "linux", reason="malloc is another")
def test_memory_of_one_batch_is_kept_for_the_next():
    # In a process of its own: what is freed depends on what else was allocated.
    done = subprocess.run([sys.executable, "-c", _PAGE_FAULTS], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 2**12  # a single one of the 8 batches writes to 2^13 pages


def test_an_error_reaches_the_caller():
    def work(batch: int) -> int:
        if batch == 1:
            raise ValueError("batch 1")
        return batch

    for n in (1, 2):
        with torch_threads(n), pytest.raises(ValueError, match="batch 1"):
            map_batches(work, range(3), CPU)
