"""What all tests share."""

from __future__ import annotations

import os
from pathlib import Path

# One core a process: the tests measure nothing, and torch's and Mesa's threads only get in each other's way.
os.environ.setdefault("LP_NUM_THREADS", "1")

import pytest
import torch

from tests.collecting import collect


@pytest.fixture(scope="session", autouse=True)
def two_threads() -> None:
    torch.set_num_threads(2)


@pytest.fixture(scope="session")
def collected(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small dataset made by one worker without any trouble; not to be changed."""
    out = tmp_path_factory.mktemp("collected") / "data"
    done = collect(out, "--workers", "1")
    assert done.returncode == 0, done.stderr
    return out
