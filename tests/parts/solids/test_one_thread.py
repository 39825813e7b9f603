"""Threads of manifold3d."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

PROGRAM = """
import os
from manifold3d import Manifold
from mskgrasp.parts.solids.one_thread import hold_manifold_to_one_thread
cores = os.sched_getaffinity(0)
{hold}
assert os.sched_getaffinity(0) == cores
before = len(os.listdir("/proc/self/task"))
body = Manifold.sphere(1.0, 300)
for shift in (0.3, 0.4, 0.5):
    (body - body.translate((shift, 0.0, 0.0))).volume()
print(len(os.listdir("/proc/self/task")) - before)
"""


@pytest.mark.skipif(
    not hasattr(os, "sched_getaffinity") or len(os.sched_getaffinity(0)) < 2,
    reason="with one core there is one thread in any case",
)
@pytest.mark.parametrize(("hold", "threads"), [("hold_manifold_to_one_thread()", False), ("", True)])
def test_manifold_begins_no_threads_of_its_own_once_held_to_one(hold: str, threads: bool) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(hold=hold)], capture_output=True, text=True, check=True
    )

    assert (int(done.stdout) > 0) == threads
