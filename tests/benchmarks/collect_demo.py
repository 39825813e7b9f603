"""Rate at which `make collect` collects. Run: python -m tests.benchmarks.collect_demo --help.

The program as users start it, in a process of its own, its start and the pictures at the end included.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from mskgrasp.core.shipped import config_file
from mskgrasp.dataset import list_shards, read_success
from mskgrasp.runtime import cli
from mskgrasp.runtime.console_table import Table
from tests.benchmarks.report import show


def main() -> int:
    """Prints a table of one row."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--out", type=Path, help="folder of report.json and report.md")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        command = [
            sys.executable,
            "-m",
            "mskgrasp.collect",
            "--config",
            str(config_file("collect/demo.yaml")),
        ]
        started = time.perf_counter()
        subprocess.run([*command, "--out", folder], check=True)
        seconds = time.perf_counter() - started
        lifted = [bool(one) for shard in list_shards(Path(folder)) for one in read_success(shard)[0]]
    row = (f"{seconds:.0f} s", f"{len(lifted) / seconds:.1f}", f"{sum(lifted) / len(lifted):.1%}")
    table = Table(header=("time", "grasps/s", "lifted"), rows=[row])
    show([table], options.out, {"n": f"{len(lifted)} grasps, seed 0; {os.cpu_count()} workers"})
    return 0


if __name__ == "__main__":
    cli.run("collect_demo", main)
