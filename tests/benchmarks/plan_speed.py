"""Time of a plan. Run: python -m tests.benchmarks.plan_speed --help.

In one run, picture by picture in turn, on the same frames of the simulated cell with the same number of
candidates: our planner and network, and the same planner around the paper's network in plain PyTorch. Timed
is the whole of `Planner.plan`: finding the part, drawing candidates, cropping, both networks, choosing.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import time
from pathlib import Path

import numpy as np
import torch
from rich.console import Console
from rich.table import Table

from hal import RgbdFrame, open_cell
from mskgrasp.core.config import read_config
from mskgrasp.core.settings import REGION, TABLE_Z
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.grasp_models import ModelMeta, Models, build_models, load_models
from mskgrasp.learning.network_config import Normalisation
from mskgrasp.parts import starter_names
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import present
from mskgrasp.planning.planner import Planner
from mskgrasp.runtime import cli
from mskgrasp.runtime.progress import progress

REPOSITORY = Path(__file__).parents[2]
STAGES = ("sample", "score", "select")
SCALE = Normalisation(action_scale=(0.05, 0.05, 0.02))


def main() -> None:
    """Prints a table and, last, one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--models", type=Path, help="trained model (default: fresh weights, as fast)")
    parser.add_argument("--frames", type=int, default=8, help="parts to look at (default 8)")
    parser.add_argument("--repeats", type=int, default=5, help="plans of ours a frame (default 5)")
    parser.add_argument("--candidates", type=int, default=3200, help="grasps a plan (default 3200)")
    options = parser.parse_args()
    torch.set_num_threads(min(2, os.cpu_count() or 1))
    device = "cuda" if torch.cuda.is_available() else "cpu"
    ours = load_models(options.models, device) if options.models else fresh("default", device)
    planners = {
        "ours": planner(ours, PlannerConfig(n_candidates=options.candidates)),
        "paper": planner(
            fresh("paper", device), PlannerConfig(n_candidates=options.candidates, chunk_size=32)
        ),
    }
    seconds: dict[str, list[float]] = {name: [] for name in planners}
    stages: dict[str, list[dict[str, float]]] = {name: [] for name in planners}
    shown = frames(options.frames)
    for one in planners.values():
        one.plan(shown[0], np.random.default_rng(0))  # kernels are chosen, caches filled
    for number, frame in enumerate(progress(shown, unit="frame")):
        for name, one in planners.items():
            for repeat in range(options.repeats if name == "ours" else 1):
                rng = np.random.default_rng([number, repeat])
                began = time.perf_counter()
                plan = one.plan(frame, rng)
                if device == "cuda":
                    torch.cuda.synchronize()
                seconds[name].append(time.perf_counter() - began)
                stages[name].append(plan.seconds)
    report(seconds, stages, options.candidates, device)


def fresh(config: str, device: str) -> Models:
    """Networks of a training configuration with weights that learned nothing."""
    network = read_config(LearningConfig, REPOSITORY / "configs" / "train" / f"{config}.yaml").network
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(0)
        return build_models(ModelMeta(network=network, normalisation=SCALE), device)


def planner(models: Models, config: PlannerConfig) -> Planner:
    """A planner for the simulated cell's table."""
    return Planner(models, config, table_z=TABLE_Z, region=REGION)


def frames(n: int) -> list[RgbdFrame]:
    """Pictures of n parts of the starter set, large and small, on the simulated cell's table."""
    names = starter_names()
    chosen = [names[int(i)] for i in np.linspace(0, len(names) - 1, min(n, len(names)))]
    found = []
    with open_cell(REPOSITORY / "configs" / "cells" / "sapien.yaml") as cell:
        for seed, name in enumerate(chosen):
            present(cell, name, seed)
            found.append(cell.camera.capture(5.0))
    return found


def report(
    seconds: dict[str, list[float]], stages: dict[str, list[dict[str, float]]], n: int, device: str
) -> None:
    """A table, and the numbers for programs."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column(f"{n} candidates, {device}")
    for header in ("p50 ms", "p95 ms", *STAGES):
        table.add_column(header, justify="right")
    for name, times in seconds.items():
        spent = [np.median([1e3 * one[stage] for one in stages[name]]) for stage in STAGES]
        whole = [1e3 * np.percentile(times, share) for share in (50, 95)]
        table.add_row(name, *(f"{value:.0f}" for value in (*whole, *spent)))
    Console(width=100).print(table)
    p50, paper = (float(np.median(seconds[name])) for name in ("ours", "paper"))
    result = {
        "p50_ms": round(1e3 * p50, 1),
        "p95_ms": round(1e3 * float(np.percentile(seconds["ours"], 95)), 1),
        "paper_p50_ms": round(1e3 * paper, 1),
        "ratio": round(paper / p50, 1),
        "peak_gib": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20, 2),
    }
    print(json.dumps(result))


if __name__ == "__main__":
    cli.run("plan_speed", main)
