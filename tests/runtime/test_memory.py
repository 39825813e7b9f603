"""Freed memory that stays with the process."""

from __future__ import annotations

import subprocess
import sys

import pytest

CODE = """
import resource, sys
import numpy as np
from mskgrasp.runtime.memory import keep_freed_memory

if sys.argv[1] == "kept":
    keep_freed_memory()

def work():
    arrays = [np.ones(500_000) for _ in range(10)]  # 40 MB

work()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(10):
    work()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the parameters are glibc's")
def test_memory_that_was_freed_is_used_again_without_page_faults():
    faults = {
        how: int(subprocess.run([sys.executable, "-c", CODE, how], capture_output=True, check=True).stdout)
        for how in ("default", "kept")
    }
    assert faults["default"] > 10_000  # of pages of 4 kB
    assert faults["kept"] < 500
