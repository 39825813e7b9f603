"""What a coarse lift changes, by the mass of the part. Run: python -m tests.benchmarks.coarse_lift --help.

The same grasps of parts of the catalogue, from light to heavy, lifted finely, lifted coarsely whatever their
mass, and lifted finely with the part moved by 10 um: what the last differs by, no rate can be asked to keep.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import torch
from rich.console import Console
from rich.table import Table

from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.settings import ExecutionNoise, Overhead, Physics
from mskgrasp.parts import chosen_names, find_part
from mskgrasp.runtime.progress import progress
from mskgrasp.runtime.worker_process import one_thread_a_process
from mskgrasp.simulation.shard import Simulator, draw_attempt

GRAMS = (0, 10, 20, 30, 45, 70, 120, 250)
"""Bounds of the rows."""
MOVED = 1e-5
"""Way of the part's start for the floor, m."""


def main() -> None:
    """Prints a row a range of masses."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--parts", type=int, default=14, help="parts of each range of masses (default 14)")
    parser.add_argument("--grasps", type=int, default=14, help="grasps of each part (default 14)")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    options = parser.parse_args()
    mass = {name: 1e3 * find_part(name).mass for name in chosen_names(["catalogue"])}
    picked = []
    for low, high in zip(GRAMS, GRAMS[1:], strict=False):
        names = sorted((name for name, grams in mass.items() if low <= grams < high), key=mass.__getitem__)
        spread = np.linspace(0, len(names) - 1, min(options.parts, len(names)))
        picked.append([names[int(i)] for i in spread])
    jobs = [(name, options.grasps) for names in picked for name in names]
    context = multiprocessing.get_context("spawn")  # a forked simulator shares the parent's driver state
    with one_thread_a_process(), ProcessPoolExecutor(options.workers, mp_context=context) as pool:
        done = dict(progress(pool.map(_lift, *zip(*jobs, strict=True)), total=len(jobs), unit="part"))
    table = Table(box=None, pad_edge=False, header_style="bold")
    for header in ("grams", "grasps", "lifted", "", "S agrees", "mm", "degrees", "overlap mm"):
        table.add_column(header, justify="right")
    for low, high, names in zip(GRAMS, GRAMS[1:], picked, strict=False):
        rows = np.concatenate([done[name] for name in names])
        for number, label in ((1, "coarse"), (2, "floor")):
            table.add_row(f"{low}-{high}", f"{len(rows)}", *_compared(rows[:, 0], rows[:, number], label))
    Console(width=100).print(table)


def _compared(fine: np.ndarray, other: np.ndarray, label: str) -> list[str]:
    won, also = np.isfinite(fine[:, 0]), np.isfinite(other[:, 0])
    difference = other[won & also, :4] - fine[won & also, :4]
    shift = 1e3 * np.linalg.norm(difference[:, :3], axis=1)
    turn = np.degrees(np.abs(wrap_angle(difference[:, 3])))
    return [
        f"{also.mean():.1%}",
        label,
        f"{(won == also).mean():.1%}",
        *(f"{np.median(values):.2f} / {np.percentile(values, 90):.2f}" for values in (shift, turn)),
        f"{1e3 * np.percentile(other[:, 4], 99):.2f}",
    ]


def _lift(name: str, n: int) -> tuple[str, np.ndarray]:
    """(grasps, 3, 5): displacement, NaN where failed, and overlap; finely, coarsely, and finely moved."""
    torch.set_num_threads(1)
    physics = Physics()
    folder = str(find_part(name).folder)
    fine, coarse = (
        Simulator(physics.model_copy(update=change), Overhead(), ExecutionNoise()).load(folder)
        for change in ({"coarse_rate_hz": physics.rate_hz}, {"coarse_mass": 1e-6})
    )
    rng = np.random.default_rng(0)
    rows = []
    for attempt in range(4 * n):
        _, grasp = draw_attempt(fine, name, 2, attempt)
        if grasp is None or len(rows) == n:
            continue
        start = fine.part_pose().as_vector()[0].double().numpy()
        angle = rng.uniform(0, 2 * np.pi)
        moved = start + MOVED * np.array([np.cos(angle), np.sin(angle), 0, 0, 0, 0, 0])
        own = []
        for env, pose in ((fine, start), (coarse, start), (fine, moved)):
            env.reset(seed=0, options=dict(pose_base_obj=pose[None]))
            outcome = env.attempt.run(torch.as_tensor(grasp))
            own.append([*outcome["displacement"][0].tolist(), float(outcome["penetration"][0])])
        rows.append(own)
    fine.close()
    coarse.close()
    return name, np.array(rows, dtype=np.float64).reshape(-1, 3, 5)


if __name__ == "__main__":
    main()
