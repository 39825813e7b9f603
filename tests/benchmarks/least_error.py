"""The least error of any predictor that sees a part only so well: python -m tests.benchmarks.least_error.

A grasp on an edge is a coin toss. Each grasp is simulated several times, the part moved and turned a little
each time, by less than a camera resolves. A predictor that knows the grasp, but not which of these starts it
was, errs at least by the spread of the displacements: the deviation within a grasp, over all grasps, is the
least RMSE of any predictor, one that knows the part's hulls, its mass and its friction included.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import zlib
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import torch
from rich.console import Console
from rich.table import Table

from mskgrasp.core.geometry import quat_about_z, quat_multiply, wrap_angle
from mskgrasp.core.settings import ExecutionNoise, Overhead, Physics
from mskgrasp.parts import chosen_names, find_part
from mskgrasp.runtime.progress import progress
from mskgrasp.runtime.worker_process import one_thread_a_process
from mskgrasp.simulation.shard import FIELDS, Simulator, discard_reason, draw_attempt

SPREADS = ((1e-5, 0.01), (1e-4, 0.1), (3e-4, 0.3), (1e-3, 1.0))
"""Deviations of the part's place along each axis of the table, m, and of its turn, degrees."""


def main() -> None:
    """Prints a row a spread."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--parts", nargs="+", default=["test"], help="names or sets (default: test)")
    parser.add_argument("--n-parts", type=int, default=60, help="so many of them, evenly (default 60)")
    parser.add_argument("--grasps", type=int, default=20, help="grasps of each part (default 20)")
    parser.add_argument("--repeats", type=int, default=4, help="starts of each grasp (default 4)")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    options = parser.parse_args()
    names = chosen_names(options.parts)
    picked = [names[int(i)] for i in np.linspace(0, len(names) - 1, min(options.n_parts, len(names)))]
    table = Table(box=None, pad_edge=False, header_style="bold")
    headers = ("place mm", "turn deg", "grasps", "S differs", "least mm", "least deg")
    for header in headers:
        table.add_column(header, justify="right")
    jobs = [(name, options.grasps, options.repeats, *spread) for spread in SPREADS for name in picked]
    context = multiprocessing.get_context("spawn")  # a forked simulator shares the parent's driver state
    with one_thread_a_process(), ProcessPoolExecutor(options.workers, mp_context=context) as pool:
        done = list(progress(pool.map(_simulate, *zip(*jobs, strict=True)), total=len(jobs), unit="part"))
    for k, (place, turn) in enumerate(SPREADS):
        rows = np.concatenate(done[k * len(picked) : (k + 1) * len(picked)])
        table.add_row(f"{1e3 * place:g}", f"{turn:g}", *least_errors(rows))
    Console(width=100).print(table)


def least_errors(displacements: np.ndarray) -> list[str]:
    """For the table, of displacements (grasps, repeats, 4), NaN where a grasp failed.

    Returns:
        Grasps, share of those whose success differs, least RMSE in mm and in degrees.
    """
    held = np.isfinite(displacements[..., 0])
    several = held.sum(axis=1) >= 2
    shift, turn, weight = [], [], []
    for rows, of in zip(displacements[several], held[several], strict=True):
        got = rows[of]
        middle = np.arctan2(np.sin(got[:, 3]).mean(), np.cos(got[:, 3]).mean())
        freedom = len(got) / (len(got) - 1)  # a mean of few lies nearer to them than the true one
        shift.append(freedom * ((got[:, :3] - got[:, :3].mean(axis=0)) ** 2).sum(axis=1).mean())
        turn.append(freedom * (wrap_angle(got[:, 3] - middle) ** 2).mean())
        weight.append(len(got))
    rms = [np.sqrt(np.average(values, weights=weight)) for values in (shift, turn)]
    torn = held.any(axis=1) & ~held.all(axis=1)
    return [
        f"{len(displacements)}",
        f"{torn.mean():.1%}",
        f"{1e3 * rms[0]:.2f}",
        f"{np.degrees(rms[1]):.2f}",
    ]


def _simulate(name: str, grasps: int, repeats: int, place: float, turn_deg: float) -> np.ndarray:
    torch.set_num_threads(1)
    env = Simulator(Physics(), Overhead(), ExecutionNoise()).load(str(find_part(name).folder))
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    rows = []
    for attempt in range(grasps):
        _, grasp = draw_attempt(env, name, 1, attempt)
        if grasp is None:
            continue
        start, own = env.part_pose().as_vector()[0].double().numpy(), []
        for _ in range(repeats):
            pose = start.copy()
            pose[:2] += rng.normal(0, place, 2)
            spun = quat_about_z(np.asarray(np.radians(rng.normal(0, turn_deg))))
            pose[3:] = quat_multiply(spun, start[3:])
            env.reset(seed=0, options=dict(pose_base_obj=pose[None]))
            outcome = env.attempt.run(torch.as_tensor(grasp))
            row = {field: outcome[field][0].numpy() for field in FIELDS}
            # What a dataset cannot hold, no predictor is judged on.
            own.append(np.full(4, np.nan) if discard_reason(outcome, row) else row["displacement"])
        rows.append(own)
    env.close()
    return np.array(rows, dtype=np.float64).reshape(-1, repeats, 4)


if __name__ == "__main__":
    main()
