"""What all tests share."""

from __future__ import annotations

import os

# One core a process: the tests measure nothing, and torch's and Mesa's threads only get in each other's way.
os.environ.setdefault("LP_NUM_THREADS", "1")

import pytest
import torch


@pytest.fixture(scope="session", autouse=True)
def two_threads() -> None:
    torch.set_num_threads(2)
