"""Memory of a long run. Run: python -m tests.benchmarks.soak --help.

One process plans and executes grasps in the simulated cell, part after part, as `mskgrasp.evaluate` does, and
its memory is read after every trial: anonymous pages, in memory or swapped out, which no other file can share
and which the system cannot drop. The first fifth of the time fills caches and is left out. A line is fitted
to the rest; what its slope may be at most, and at least, decides.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.stats import t as student

from mskgrasp.core.seeds import trial_seeds
from mskgrasp.core.shipped import PRETRAINED, config_file
from mskgrasp.parts import find_part, starter_names
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import make_planner
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.progress import progress
from mskgrasp.trials.engine import connected_engine
from mskgrasp.trials.measurement import finish, run_trial
from tests.benchmarks.report import show

WARM_UP = 0.2
"""Share of the time before memory counts."""
BLOCKS = 12
"""Means of blocks are fitted: neighbouring samples are alike, and would make the interval too narrow."""
FLAT_MB_PER_H = 20.0
"""A process that grows by less fills half a gigabyte in a day."""
MEGABYTE = 2**20


@dataclass(frozen=True)
class Growth:
    """Slope of the memory over time, megabytes an hour, with its 95 % interval."""

    slope: float
    low: float
    high: float

    @property
    def verdict(self) -> str:
        """flat, grows, or undecided."""
        if self.high <= FLAT_MB_PER_H:
            return "flat"
        return "grows" if self.low > FLAT_MB_PER_H else "undecided"


def main() -> int:
    """Print a table and, last, one JSON object; 1 if memory grows."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--minutes", type=float, default=120.0, help="length of the run (default 120)")
    parser.add_argument(
        "--parts", nargs="*", default=[], help="names of parts in turn (default: the starter set)"
    )
    parser.add_argument("--candidates", type=int, default=3200, help="grasps a plan (default 3200)")
    parser.add_argument("--seed", type=int, default=0, help="of the scenes (default 0)")
    parser.add_argument("--out", type=Path, help="folder for report.json and report.md")
    options = parser.parse_args()
    parts = options.parts or list(starter_names())
    hours, memory, lifted = soak(parts, 60 * options.minutes, options.candidates, options.seed)
    try:
        found = growth(hours, memory)
    except ValueError as error:
        parser.error(str(error))
    header = (
        "minutes",
        "trials",
        "parts",
        "lifted",
        "MB at first",
        "MB at last",
        "growth, MB/h",
        "95 % interval",
        "verdict",
    )
    row = (
        f"{60 * hours[-1]:.0f}", len(hours), len(parts), f"{lifted / len(hours):.0%}",
        f"{memory[0]:.0f}", f"{memory[-1]:.0f}",
        f"{found.slope:+.1f}", f"{found.low:+.1f} to {found.high:+.1f}", found.verdict,
    )  # fmt: skip
    values = dict(
        minutes=60 * hours[-1], trials=len(hours), lifted=lifted, slope_mb_per_h=found.slope,
        interval_mb_per_h=[found.low, found.high], verdict=found.verdict, flat_mb_per_h=FLAT_MB_PER_H,
        samples=[[round(60 * h, 3), round(mb, 2)] for h, mb in zip(hours, memory, strict=True)],
    )  # fmt: skip
    show([Table(header=header, rows=[row])], options.out, values)
    print(json.dumps({key: value for key, value in values.items() if key != "samples"}))
    return int(found.verdict == "grows")


def soak(
    parts: Sequence[str], seconds: float, n_candidates: int, seed: int
) -> tuple[list[float], list[float], int]:
    """Run trials for some time.

    Returns:
        Hours since the start and megabytes after every trial, and the number of trials that lifted the part.
    """
    for part in parts:
        find_part(part)  # built here where it is missing, not within the time
    hours, memory, lifted = [], [], 0
    with TemporaryDirectory() as folder, progress(total=round(seconds), unit="s", keep=True) as bar:
        began = time.monotonic()
        for success in trials(parts, n_candidates, seed, Path(folder)):
            passed = time.monotonic() - began
            lifted += success
            hours.append(passed / 3600)
            memory.append(own_memory() / MEGABYTE)
            bar.set_postfix_str(f"{len(hours)} trials, {memory[-1]:.0f} MB", refresh=False)
            bar.update(min(round(passed), round(seconds)) - bar.n)
            if passed >= seconds:
                break
    return hours, memory, lifted


def trials(parts: Sequence[str], n_candidates: int, seed: int, folder: Path) -> Iterator[bool]:
    """Trials without an end, part after part; whether each lifted the part."""
    cell = config_file("cells/sapien.yaml")
    with connected_engine(cell, yes=True, picture=folder / "next.png", tape=None) as engine:
        planner = make_planner(PRETRAINED, PlannerConfig(n_candidates=n_candidates), engine.cell)
        for number in count():
            part = parts[number % len(parts)]
            scene, _ = trial_seeds(seed, part, number)
            planned = engine.present(part, scene, planner)
            record = run_trial(engine, planned, part=part, number=number, seed=scene)
            yield record.trial.success
            finish(engine, record)


def own_memory() -> int:
    """Anonymous memory of this process, bytes: what it has asked for and written to."""
    lines = Path("/proc/self/status").read_text().splitlines()
    sizes = {name: value for name, _, value in (line.partition(":") for line in lines)}
    return 1024 * sum(int(sizes[name].split()[0]) for name in ("RssAnon", "VmSwap"))


def growth(hours: Sequence[float], megabytes: Sequence[float]) -> Growth:
    """Slope of the memory after the warm-up, by least squares on means of blocks.

    Raises:
        ValueError: There are fewer samples than blocks.
    """
    time_h, memory = np.array(hours), np.array(megabytes)
    late = time_h >= WARM_UP * time_h[-1]
    if late.sum() < BLOCKS:
        raise ValueError(f"{late.sum()} trials after the warm-up, {BLOCKS} are needed: run longer")
    x, y = (
        np.array([block.mean() for block in np.array_split(values[late], BLOCKS)])
        for values in (time_h, memory)
    )
    x = x - x.mean()
    slope = float(x @ y / (x @ x))
    rest = y - y.mean() - slope * x
    error = float(np.sqrt(rest @ rest / (BLOCKS - 2) / (x @ x)))
    half = float(student.ppf(0.975, BLOCKS - 2)) * error
    return Growth(slope, slope - half, slope + half)


if __name__ == "__main__":
    raise SystemExit(main())
