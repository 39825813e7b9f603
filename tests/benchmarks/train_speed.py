"""Rate of training. Run: python -m tests.benchmarks.train_speed --help.

In one run, in turn: steps of our networks and of the paper's, on the same number of samples that lie in
memory as a dataset's do. A step is everything from the stored samples to the new weights.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from pathlib import Path

import torch

from mskgrasp.core.config import read_config
from mskgrasp.learning.compute_device import compute_device
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.grasp_models import build_models
from mskgrasp.learning.samples import Samples
from mskgrasp.learning.sides import split
from mskgrasp.learning.stage import Stage
from mskgrasp.learning.trainer import describe_networks
from mskgrasp.runtime import cli
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.progress import progress
from tests.benchmarks.report import show

REPOSITORY = Path(__file__).parents[2]
WHOSE = {"default": "ours", "paper": "the paper's"}
"""Whose networks a configuration of training describes."""


def main() -> int:
    """Prints the table."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.train_speed", description="Measure samples/s of training."
    )
    parser.add_argument("--samples", type=int, default=2048, help="samples to learn from (default 2048)")
    parser.add_argument("--seconds", type=float, default=20.0, help="for each network (default 20)")
    parser.add_argument("--out", type=Path, help="folder of report.json and report.md")
    options = parser.parse_args()
    torch.set_num_threads(min(2, os.cpu_count() or 1))
    device = str(compute_device())
    found = {}
    for name in progress(WHOSE, unit="architecture"):
        config = read_config(LearningConfig, REPOSITORY / "configs" / "train" / f"{name}.yaml")
        found[name] = measure(random_samples(config, options.samples), config, device, options.seconds)
    rows = [(WHOSE[name], *(format(round(one[key]), ",").replace(",", " ") for key in ("gqn", "gdn")),
             f"{one['share']:.0%}") for name, one in found.items()]  # fmt: skip
    ours, paper = found.values()
    rows.append(("ours / the paper's", *(f"{ours[key] / paper[key]:.0f}" for key in ("gqn", "gdn")), "-"))
    header = (
        f"samples/s, {device}",
        "quality network",
        "displacement network",
        "quality network: share of a step after preparing its samples",
    )
    show([Table(header=header, rows=rows)], options.out)
    return 0


def measure(samples: Samples, config: LearningConfig, device: str, seconds: float) -> dict[str, float]:
    """Samples/s of both networks, and the share of the GQN's time that is not spent on preparing samples."""
    sides = split(samples, config)
    models = build_models(describe_networks(samples, sides.training, config), device)
    stages = {name: Stage(name, models, samples, sides, config) for name in ("gqn", "gdn")}
    for stage in stages.values():
        stage.network.train()
    rates = {name: rate(stage, stage.learn, seconds) for name, stage in stages.items()}
    preparing = rate(stages["gqn"], stages["gqn"].batch, seconds / 4)
    return rates | {"share": 1 - rates["gqn"] / preparing}


def rate(stage: Stage, work: Callable[[torch.Tensor], object], seconds: float) -> float:
    """Samples/s of some work on a stage's batches, the first few not counted."""
    order = torch.Generator().manual_seed(0)
    steps, samples, began = -3, 0, 0.0
    while steps < 1 or time.perf_counter() - began < seconds:
        for rows in stage.order(order).to(stage.models.device).split(stage.settings.batch_size):
            if steps == 0:
                began = time.perf_counter()
            work(rows)
            samples += len(rows) if steps >= 0 else 0
            steps += 1
            if steps > 0 and time.perf_counter() - began > seconds:
                break
    if stage.models.device.type == "cuda":
        torch.cuda.synchronize()
    return samples / (time.perf_counter() - began)


def random_samples(config: LearningConfig, n: int) -> Samples:
    """Noise in the shape of a dataset: what it shows makes no step slower."""
    generator = torch.Generator().manual_seed(0)
    success = torch.rand(n, generator=generator) < 0.5
    shift = 0.003 * torch.randn((n, 4), generator=generator)
    return Samples(
        patches=torch.randint(
            0, 400, (n, 1, *config.network.patch_shape), generator=generator, dtype=torch.int16
        ),
        object_patches=None,
        theta=torch.zeros(n),
        centre_grasp=0.02 * torch.randn((n, 3), generator=generator),
        origin_grasp=0.02 * torch.randn((n, 3), generator=generator),
        quat_grasp_obj=torch.tensor([[1.0, 0.0, 0.0, 0.0]]).expand(n, 4),
        height=0.02 + 0.02 * torch.rand(n, generator=generator),
        success=success,
        displacement=shift,
        grasp_displacement=shift,
        swing=torch.zeros((n, 2)),
        part=torch.arange(n) % 20,
        planned=torch.zeros(n, dtype=torch.bool),
        parts=tuple(f"part_{number}" for number in range(20)),
        skipped={},
        fingerprint="noise",
    )


if __name__ == "__main__":
    cli.run("train_speed", main)
