"""Work of the networks on batches, a thread a batch."""

from __future__ import annotations

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


def test_an_error_reaches_the_caller():
    def work(batch: int) -> int:
        if batch == 1:
            raise ValueError("batch 1")
        return batch

    for n in (1, 2):
        with torch_threads(n), pytest.raises(ValueError, match="batch 1"):
            map_batches(work, range(3), CPU)
