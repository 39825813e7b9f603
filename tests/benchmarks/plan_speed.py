"""Time of a plan. Run: python -m tests.benchmarks.plan_speed --help.

In one run, in turn, on the same frames of the simulated cell with the same number of candidates: our
planner and model, and the planner as in the paper around its network in plain PyTorch, with weights that
learned nothing; each also with the images' layers in bfloat16. Timed is the whole of `Planner.plan`: finding
the part, drawing candidates, cropping, both networks, choosing.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import NamedTuple
from unittest.mock import patch

import numpy as np
import torch

from hal import RgbdFrame, open_cell
from mskgrasp.core.config import read_config
from mskgrasp.core.metrics import bootstrap_interval
from mskgrasp.core.settings import REGION, TABLE_Z
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.compute_device import compute_device
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.grasp_models import ModelMeta, Models, build_models, load_models
from mskgrasp.learning.network_config import Normalisation
from mskgrasp.parts import starter_names
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import present
from mskgrasp.planning.planner import Planner
from mskgrasp.runtime import cli
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.progress import progress
from tests.benchmarks.report import show

REPOSITORY = Path(__file__).parents[2]
OURS, PAPER = "ours", "the paper's"
IN_BFLOAT16 = ", bfloat16"
STAGES = ("sample", "score", "select")
SCALE = Normalisation(action_scale=(0.05, 0.05, 0.02))


class Timed(NamedTuple):
    """Seconds of a plan, and of its stages."""

    whole: float
    stages: dict[str, float]


def main() -> int:
    """Prints the tables."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.plan_speed", description="Measure the time of a plan."
    )
    parser.add_argument(
        "--models", type=Path, default=PRETRAINED, help="our model (default: the shipped one)"
    )
    parser.add_argument("--frames", type=int, default=8, help="parts to look at (default 8)")
    parser.add_argument("--repeats", type=int, default=5, help="plans of each frame (default 5)")
    parser.add_argument("--candidates", type=int, default=3200, help="grasps a plan (default 3200)")
    parser.add_argument("--out", type=Path, help="folder of report.json and report.md")
    options = parser.parse_args()
    torch.set_num_threads(min(2, os.cpu_count() or 1))
    device = compute_device().type
    ours = PlannerConfig(n_candidates=options.candidates)
    paper = ours.model_copy(update={"chunk_size": 32, "recentre": False})
    planners = {
        OURS: planner(load_models(options.models, device), ours),
        PAPER: planner(fresh("paper", device), paper),
    }
    shown = frames(options.frames)
    ways = {name + also: (one, also) for also in ("", IN_BFLOAT16) for name, one in planners.items()}
    timed: dict[str, list[list[Timed]]] = {name: [[] for _ in shown] for name in ways}
    for one, also in ways.values():
        with bfloat16() if also else nullcontext():
            one.plan(shown[0], np.random.default_rng(0))  # kernels are chosen, caches filled
    for number, frame in enumerate(progress(shown, unit="frame")):
        for repeat in range(options.repeats):
            for name, (one, also) in ways.items():
                with bfloat16() if also else nullcontext():
                    began = time.perf_counter()
                    plan = one.plan(frame, np.random.default_rng([number, repeat]))
                    if device == "cuda":
                        torch.cuda.synchronize()
                    timed[name][number].append(Timed(time.perf_counter() - began, plan.seconds))
    show(tables_of(timed, f"{options.candidates} candidates, {device}"), options.out)
    return 0


@contextmanager
def bfloat16() -> Iterator[None]:
    """Networks predict with the images' layers in bfloat16, which they ship without."""

    def autocast(features: torch.nn.Module) -> torch.autocast:
        return torch.autocast(next(features.parameters()).device.type, dtype=torch.bfloat16)

    with (
        patch("mskgrasp.learning.hand_features.image_autocast", autocast),
        patch("mskgrasp.learning.networks.image_autocast", autocast),
    ):
        yield


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


def tables_of(timed: Mapping[str, Sequence[Sequence[Timed]]], title: str) -> list[Table]:
    """Times of each planner, by frame, and how many times as long the paper's network takes."""
    whole = {name: [np.array([one.whole for one in frame]) for frame in each] for name, each in timed.items()}
    rows = []
    for name, each in timed.items():
        all_of = [one for frame in each for one in frame]
        low, high = bootstrap_interval(whole[name], np.median)
        rows.append((
            name, *(f"{1e3 * np.percentile([one.whole for one in all_of], share):.0f}" for share in (50, 95)),
            f"{1e3 * low:.0f} - {1e3 * high:.0f}",
            *(f"{1e3 * np.median([one.stages[stage] for one in all_of]):.0f}" for stage in STAGES),
        ))  # fmt: skip
    ratios = []
    for numbers, also in (("float32", ""), ("bfloat16", IN_BFLOAT16)):
        pairs = zip(whole[OURS + also], whole[PAPER + also], strict=True)
        times = [np.array([np.median(paper) / np.median(ours)]) for ours, paper in pairs]
        low, high = bootstrap_interval(times, np.median)
        ratios.append((numbers, f"{np.median(np.concatenate(times)):.0f}", f"{low:.0f} - {high:.0f}"))
    header = (
        title,
        "median, ms",
        "95th percentile",
        "interval of the median",
        *(f"{s}, ms" for s in STAGES),
    )
    return [
        Table(header=header, rows=rows),
        Table(header=("", "the paper's network, times as long", "interval"), rows=ratios),
    ]


if __name__ == "__main__":
    cli.run("plan_speed", main)
