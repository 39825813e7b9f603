"""Rate of simulated grasps. Run: python -m tests.benchmarks.collect_speed --help.

In one run, on one core, with the same parts, starts and grasps, part by part in turn: (a) a ManiSkill loop,
``pd_ee_pose`` at 20 Hz with one depth image an attempt, at ManiSkill's default physics and at ours; (b) a raw
SAPIEN script with the collector's physics and shortcuts; (c) the collector, shards written to disk. Processor
time of all of it, the loading of the part's scene included. Then the collector as users start it, with one
worker and with two.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("LP_NUM_THREADS", "0")  # the software renderer stays in the thread that asks it

import gymnasium
import numpy as np
import sapien
import torch
import trimesh
from sapien.physx import PhysxCpuSystem

from mskgrasp.collect.config import CollectConfig
from mskgrasp.collect.run import plan_shards
from mskgrasp.collect.workers import make_shards
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import PAD_REACH
from mskgrasp.core.settings import REGION, ExecutionNoise, Overhead, Physics
from mskgrasp.parts import Part, find_part, starter_names
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.progress import progress
from mskgrasp.runtime.worker_pool import JobResult
from mskgrasp.simulation.shard import Simulator, draw_attempt
from mskgrasp.simulation.shard_task import ShardTask
from mskgrasp.simulation.versions import versions
from tasks import GraspDisplacementEnv
from tasks.scene.renderer import render_backend
from tasks.scene.table_friction import TableFriction
from tests.benchmarks.raw_sapien import RawSapien
from tests.benchmarks.report import show

Draw = tuple[np.ndarray, np.ndarray, np.ndarray]
"""The part's pose (7,), the grasp (4,), and where the hand comes from (4,)."""


SEED = 0
MANISKILL = dict(
    rate_hz=100, coarse_rate_hz=100, position_iterations=15, contact_offset=0.02, persistent_manifold=True
)
"""ManiSkill's defaults."""


@dataclass
class Row:
    """One program: its processor time, of it that in PhysX and the renderer, and in friction on the table."""

    program: str
    grasps: int = 0
    lifted: int = 0
    seconds: float = 0.0
    inside: float = 0.0
    friction: float = 0.0


def main() -> None:
    """Prints tables and, last, one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--parts", type=int, default=6, help="parts of the starter set (default 6)")
    parser.add_argument("--attempts", type=int, default=25, help="attempts a part (default 25)")
    parser.add_argument(
        "--shards", type=int, default=2,
        help="shards of 25 attempts a part for the scaling (default 2); 0: it is not measured",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, help="folder of report.json and report.md")
    parser.add_argument(
        "--endurance", type=int, default=0,
        help="only let one worker make so many attempts, 10000 say, and compare each tenth of them",
    )  # fmt: skip
    options = parser.parse_args()
    logging.getLogger("mani_skill").setLevel(logging.ERROR)
    torch.set_num_threads(1)
    names = starter_names()
    chosen = [names[int(i)] for i in np.linspace(0, len(names) - 1, min(options.parts, len(names)))]
    parts = [find_part(name) for name in chosen]
    if options.endurance:
        endure(parts, options.endurance)
        return
    rows = side_by_side(parts, options.attempts)
    rates = [throughput(parts, options.shards, workers) for workers in (1, 2)] if options.shards else []
    report(rows, rates, chosen, options)


def side_by_side(parts: list[Part], n: int) -> list[Row]:
    """The programs, with n attempts a part."""
    ours = Ours()
    programs = {
        "(a) ManiSkill loop, its default physics": PlainManiSkill(parts[0], MANISKILL),
        "(a) ManiSkill loop, our physics": PlainManiSkill(parts[0], {}),
        "(b) raw SAPIEN script, same shortcuts": Raw(),
    }
    collector = "(c) the collector"
    rows = {name: Row(program=name) for name in (*programs, collector)}
    with progress(total=len(parts) * n * len(rows), unit="grasp") as bar:
        ours.shard(parts[0], 1)  # shaders are compiled, caches filled
        for number, part in enumerate(parts):
            drawn = ours.draw(part, n)
            for name, program in programs.items():
                if number == 0:
                    program.load(part)
                    program.attempt(*drawn[0])
                with ours.measured(rows[name]):
                    program.load(part)
                    for draw in drawn:
                        rows[name].lifted += program.attempt(*draw)
                        bar.update()
            with ours.measured(rows[collector]):
                rows[collector].lifted += ours.shard(part, n)
            bar.update(n)
    for row in rows.values():
        row.grasps = len(parts) * n
    return list(rows.values())


def over_the_part(part: Part, pose: np.ndarray, grasp: np.ndarray) -> np.ndarray:
    """Where a hand begins that comes down on a grasp: pads 1 cm over the part's top, at least 6 cm up."""
    corners = Pose.from_vector(pose).apply(np.asarray(trimesh.load_mesh(part.mesh_path).vertices))
    above = grasp.copy()
    above[2] = max(grasp[2] + 0.06, corners[:, 2].max() + PAD_REACH + 0.01)
    return above


class PlainManiSkill:
    """What a user of ManiSkill writes first."""

    def __init__(self, part: Part, physics: dict):
        self.env = gymnasium.make(
            "GraspDisplacement-v1", parts=[str(part.folder)], control_mode="pd_ee_pose", obs_mode="none",
            physics=physics, render_backend=render_backend(),
        )  # fmt: skip

    def load(self, part: Part) -> None:
        """A fresh scene with this part."""
        self.env.reset(seed=0, options=dict(parts=[str(part.folder)], reconfigure=True))

    def attempt(self, pose: np.ndarray, grasp: np.ndarray, above: np.ndarray) -> bool:
        """Approach, descend, close, lift, hold: 2.45 s at 20 Hz."""
        self.env.reset(seed=0, options=dict(pose_base_obj=pose[None]))
        env = self.env.unwrapped
        assert isinstance(env, GraspDisplacementEnv)
        env.capture_depth()
        top = grasp.copy()
        top[2] += 0.1
        waypoints = [
            (above, above, 12, 1),
            (above, grasp, 8, 1),
            (grasp, grasp, 10, -1),
            (grasp, top, 15, -1),
            (top, top, 4, -1),
        ]
        info: dict = {}
        for start, goal, steps, gripper in waypoints:
            for k in range(1, steps + 1):
                x, y, z, theta = start + (goal - start) * k / steps
                info = self.env.step(np.array([x, y, z, np.pi, 0, -theta, gripper], dtype=np.float32))[-1]
        return bool(info["success"])


class Raw:
    """Plain SAPIEN."""

    def __init__(self) -> None:
        x_min, x_max, y_min, y_max = REGION
        self.sim = RawSapien(Physics(), Overhead(), ((x_min + x_max) / 2, (y_min + y_max) / 2))

    def load(self, part: Part) -> None:
        """A fresh scene with this part."""
        self.sim.load(part)

    def attempt(self, pose: np.ndarray, grasp: np.ndarray, above: np.ndarray) -> bool:
        """One attempt."""
        return self.sim.attempt(pose, grasp)


class Clock:
    """Processor time spent inside some functions.

    An attempt has hundreds of steps: what reading the clock adds to each is measured on a function that does
    nothing, and taken off.
    """

    def __init__(self) -> None:
        self._inside = 0.0
        self._calls = 0
        idle = self.around(lambda: None)
        n, began = 20_000, time.process_time()
        for _ in range(n):
            idle()
        self._cost, self._own = (time.process_time() - began) / n, self._inside / n
        self.reset()

    def reset(self) -> None:
        """Forgets what was measured."""
        self._inside, self._calls = 0.0, 0

    @property
    def inside(self) -> float:
        """Seconds inside the functions."""
        return self._inside - self._calls * self._own

    @property
    def cost(self) -> float:
        """Seconds that measuring took, inside and outside of them."""
        return self._calls * self._cost

    def around(self, inner: Callable[..., Any]) -> Callable[..., Any]:
        """The same function, measured."""

        def timed(*args: object, **kwargs: object) -> object:
            began = time.process_time()
            result = inner(*args, **kwargs)
            self._inside += time.process_time() - began
            self._calls += 1
            return result

        return timed


class Ours:
    """The collector's own loop, and clocks around what every program computes with, which measure all."""

    def __init__(self) -> None:
        self.simulator = Simulator(Physics(), Overhead(), ExecutionNoise())
        self.engine, self.friction = Clock(), Clock()
        for clock, owner, name in (
            (self.engine, PhysxCpuSystem, "step"),
            (self.engine, sapien.Scene, "update_render"),
            (self.engine, sapien.render.RenderCameraComponent, "take_picture"),
            (self.engine, sapien.render.RenderCameraComponent, "get_picture"),
            (self.friction, TableFriction, "apply"),
        ):
            setattr(owner, name, clock.around(getattr(owner, name)))

    @contextmanager
    def measured(self, row: Row) -> Iterator[None]:
        """Adds the processor time of the context to a row."""
        self.engine.reset()
        self.friction.reset()
        began = time.process_time()
        yield
        row.seconds += time.process_time() - began - self.engine.cost - self.friction.cost
        row.inside += self.engine.inside
        row.friction += self.friction.inside

    def draw(self, part: Part, n: int) -> list[Draw]:
        """The first attempts at a part, as the collector draws them."""
        env = self.simulator.load(str(part.folder))
        drawn: list[Draw] = []
        attempt = 0
        while len(drawn) < n:
            _, grasp = draw_attempt(env, part.name, SEED, attempt)
            attempt += 1
            if grasp is not None:
                pose, grasp = env.part_pose().as_vector()[0].double().numpy(), grasp[0].astype(float)
                drawn.append((pose, grasp, over_the_part(part, pose, grasp)))
        return drawn

    def shard(self, part: Part, n: int) -> int:
        """A shard of n attempts, written; how many of them lifted the part."""
        task = ShardTask(part=part.name, folder=str(part.folder), index=0, first=0, n=n, seed=SEED)
        with tempfile.TemporaryDirectory() as folder:
            return sum(outcome == 1 for outcome in self.simulator.write(task, Path(folder)))


def throughput(parts: list[Part], shards: int, workers: int) -> dict[str, float]:
    """Grasps a second of the collector in its steady state, and the memory of its largest worker, GiB."""
    for name in ("OMP_NUM_THREADS", "LP_NUM_THREADS"):  # workers are to start as users start them
        os.environ.pop(name, None)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        (out / "shards").mkdir()
        config = CollectConfig(
            out=out, parts=tuple(part.name for part in parts), attempts_per_part=25 * shards, shard_size=25
        )
        tasks = plan_shards(config, parts)
        total = sum(task.n for task in tasks)
        # Workers start one after the other, and end so: neither end belongs to the steady state.
        first, last = 10 * workers, total - 25 * workers
        done, began, ended, most = 0, 0.0, 0.0, 0.0
        with progress(total=total, unit="grasp", title=f"{workers} workers") as bar:
            for event in make_shards(config, tasks, workers):
                if not isinstance(event, JobResult):
                    continue
                done += 1
                bar.update()
                if done == first:
                    began = time.perf_counter()
                if done == last:
                    ended = time.perf_counter()
                    most = largest_child()
        return {"grasps_per_s": (last - first) / (ended - began), "gib": most}


def endure(parts: list[Part], n: int) -> None:
    """Prints grasps a second and memory of one worker over each tenth of n attempts."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        (out / "shards").mkdir()
        config = CollectConfig(
            out=out,
            parts=tuple(part.name for part in parts),
            attempts_per_part=-(-n // len(parts)),
            shard_size=25,
        )
        tasks = plan_shards(config, parts)
        total = sum(task.n for task in tasks)
        done, tenths = 0, []
        began = None
        with progress(total=total, unit="grasp") as bar:
            for event in make_shards(config, tasks, 1):
                if not isinstance(event, JobResult):
                    continue
                began = began or time.perf_counter()  # the worker has started
                done += 1
                bar.update()
                if done * 10 // total > len(tenths):
                    now = time.perf_counter()
                    tenths.append((total / 10 / (now - began), largest_child("VmRSS")))
                    began = now
    for number, (rate, gib) in enumerate(tenths, 1):
        print(f"attempts up to {number * total // 10:6d}: {rate:.2f} grasps/s, {gib:.3f} GiB")
    print(json.dumps({"last_over_first": round(tenths[-1][0] / tenths[0][0], 3),
                      "gib_grown": round(tenths[-1][1] - tenths[0][1], 3)}))  # fmt: skip


def largest_child(field: str = "VmHWM") -> float:
    """Resident memory of the largest of this process's children, GiB: its greatest, or VmRSS, now."""
    most = 0.0
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            status = (folder / "status").read_text()
        except OSError:
            continue
        fields = dict(line.split(":", 1) for line in status.splitlines() if ":" in line)
        if int(fields["PPid"]) == os.getpid() and field in fields:
            most = max(most, int(fields[field].split()[0]) / 2**20)
    return most


def report(
    rows: list[Row], rates: list[dict[str, float]], parts: list[str], options: argparse.Namespace
) -> None:
    """Prints tables and the numbers for programs, and writes them where a folder is given."""
    ours = rows[-1]
    rate = {row.program: row.grasps / row.seconds for row in rows}
    table = Table(
        header=(
            "one core", "grasps/s", "collector / this program", "lifted", "in PhysX and renderer",
            "in friction on the table",
        ),
        rows=[
            (
                row.program, f"{rate[row.program]:.2f}", f"{rate[ours.program] / rate[row.program]:.2f}",
                f"{row.lifted / row.grasps:.1%}", f"{row.inside / row.seconds:.1%}",
                f"{row.friction / row.seconds:.1%}",
            )
            for row in rows
        ],
    )  # fmt: skip
    tables = [table]
    default, same, raw = (round(rate[ours.program] / rate[row.program], 2) for row in rows[:-1])
    result = {
        "ours_over_maniskill_default": default,
        "ours_over_maniskill_same_physics": same,
        "ours_over_raw": raw,
        "engine_share": round(ours.inside / ours.seconds, 3),
        "friction_share": round(ours.friction / ours.seconds, 3),
        "grasps_per_s_core": round(rate[ours.program], 2),
    }
    if rates:
        one, two = rates
        steady = [(n + 1, f"{one['grasps_per_s']:.2f}", f"{one['gib']:.2f}") for n, one in enumerate(rates)]
        tables.append(Table(header=("workers", "grasps/s, wall time", "largest worker, GiB"), rows=steady))
        result["scaling_2"] = round(two["grasps_per_s"] / one["grasps_per_s"], 2)
        result["worker_gib"] = round(max(one["gib"], two["gib"]), 2)
    values = dict(
        parts=parts, n=ours.grasps, seeds=[SEED], versions=versions(), physics=Physics().model_dump(),
        maniskill_physics=MANISKILL, rows=[asdict(row) for row in rows], workers=rates, result=result,
    )  # fmt: skip
    show(tables, options.out, values)
    print(json.dumps(result))


if __name__ == "__main__":
    main()
