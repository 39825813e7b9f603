"""Load on the server. Run: python -m tests.benchmarks.serve_load --help.

Starts ``mskgrasp.serve`` on a free port of this machine and talks to no other address. Measures requests a
second and the times of answers to /plan, beside the same plans without a server in one thread; answers to
malformed requests, none of which may be an error of the server's own or end a worker; and the memory of all
its processes, before and after.
"""

from __future__ import annotations

import argparse
import http.client
import io
import json
import os
import re
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import torch
from rich.console import Console
from rich.table import Table

from hal import RgbdFrame
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.planner import Planner
from mskgrasp.runtime.progress import progress
from mskgrasp.serve.run import simulated_table
from tests import synthetic

NPZ, JSON = "application/x-npz", "application/json"
SETTLED = 0.2
"""Share of the requests after which memory is measured first: caches are filled by then."""


def main() -> int:
    """Prints a table and, last, one JSON object; 1 if a worker ended or an answer was 5xx."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--requests", type=int, default=100, help="plans (default 100; 10000 for memory)")
    parser.add_argument("--malformed", type=int, default=100, help="malformed requests (default 100)")
    parser.add_argument("--workers", type=int, default=1, help="processes of the server (default 1)")
    parser.add_argument("--clients", type=int, default=2, help="clients at once (default 2)")
    parser.add_argument("--candidates", type=int, default=3200, help="grasps a plan (default 3200)")
    parser.add_argument("--seed", type=int, default=0, help="of parts and malformed requests (default 0)")
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    shown = [synthetic.frame([centred_box(rng)]) for _ in range(8)]
    bodies = [npz(frame) for frame in shown]
    alone = plans_alone(shown, options.candidates, min(30, options.requests))
    with server(options.workers, options.candidates, options.clients) as (process, port):
        workers = children(process.pid)
        wrong = [malformed(bodies[int(rng.integers(len(bodies)))], rng) for _ in range(options.malformed)]
        statuses = Counter(status for status, _ in ask_all(port, options.clients, wrong, "malformed"))
        first = max(1, int(SETTLED * options.requests))
        right = [("/plan", NPZ, bodies[i % len(bodies)]) for i in range(options.requests)]
        warm = ask_all(port, options.clients, right[:first], "plan")
        before = memory([process.pid, *workers])
        began = time.perf_counter()
        timed = ask_all(port, options.clients, right[first:], "plan")
        seconds = time.perf_counter() - began
        after = memory([process.pid, *workers])
        survived = children(process.pid) == workers
    return report(options, alone, [*warm, *timed], timed, seconds, statuses, (before, after), survived)


def centred_box(rng: np.random.Generator) -> synthetic.Box:
    """A box that the hand can grasp, near the middle of the simulated cell's table."""
    x, y, yaw = rng.uniform([0.43, -0.05, -1.5], [0.53, 0.05, 1.5])
    length, width, height = rng.uniform([0.04, 0.015, 0.02], [0.08, 0.04, 0.05])
    return synthetic.Box(x=x, y=y, yaw=yaw, size=(length, width, height))


def npz(frame: RgbdFrame) -> bytes:
    """The body of a request for a frame."""
    file = io.BytesIO()
    pose = frame.T_base_camera.as_vector()
    np.savez_compressed(file, depth=frame.depth, intrinsics=frame.intrinsics, T_base_camera=pose)
    return file.getvalue()


def plans_alone(frames: Sequence[RgbdFrame], candidates: int, n: int) -> list[float]:
    """Seconds of plans in this process, in one thread as in a worker."""
    torch.set_num_threads(1)
    table = simulated_table()
    planner = Planner(
        load_models(),
        PlannerConfig(n_candidates=candidates),
        table_z=table.table_z,
        region=table.region,
        min_height=table.min_height,
    )
    planner.plan(frames[0], np.random.default_rng(0))  # caches are filled
    spent = []
    for i in range(n):
        began = time.perf_counter()
        planner.plan(frames[i % len(frames)], np.random.default_rng(0))
        spent.append(time.perf_counter() - began)
    return spent


def malformed(body: bytes, rng: np.random.Generator) -> tuple[str, str, bytes]:
    """A request that is damaged at random: path, content type, body."""
    path = str(rng.choice(["/plan", "/score", "/place"]))

    def cut() -> tuple[str, bytes]:
        return NPZ, body[: int(rng.integers(len(body)))]

    def flipped() -> tuple[str, bytes]:
        changed = bytearray(body)
        for place in rng.integers(len(body), size=int(rng.integers(1, 30))):
            changed[place] ^= int(rng.integers(1, 256))
        return NPZ, bytes(changed)

    def noise() -> tuple[str, bytes]:
        return str(rng.choice([NPZ, JSON, "text/html"])), rng.bytes(int(rng.integers(5000)))

    def odd_arrays() -> tuple[str, bytes]:
        file = io.BytesIO()
        side = int(rng.integers(0, 300))
        depth = rng.choice([np.nan, np.inf, -1.0, 0.0, 0.8, 1e9], (side, 160)).astype(np.float32)
        np.savez_compressed(
            file, depth=depth, intrinsics=rng.normal(size=(3, 3)), T_base_camera=rng.normal(size=7)
        )
        return NPZ, file.getvalue()

    def odd_json() -> tuple[str, bytes]:
        values = [None, -1, 1e400, "x", [], {}, [[0.5, 0, 0, 0]], "A" * 1000, True, 10**40]
        names = ["depth_png", "intrinsics", "T_base_camera", "grasps", "seed", "grasp", "target", "other"]
        fields = {name: values[int(rng.integers(len(values)))] for name in names if rng.random() < 0.6}
        return JSON, json.dumps(fields).encode()

    kinds: list[Callable[[], tuple[str, bytes]]] = [cut, flipped, noise, odd_arrays, odd_json]
    content_type, damaged = kinds[int(rng.integers(len(kinds)))]()
    return path, content_type, damaged


@contextmanager
def server(workers: int, candidates: int, clients: int) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """The program, and its port; ended by SIGTERM."""
    options = ["--port", "0", "--workers", str(workers), "--queue", str(clients)]
    command = [sys.executable, "-m", "mskgrasp.serve", *options, "--planner.n-candidates", str(candidates)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.match(r"http://127\.0\.0\.1:(\d+):", process.stdout.readline())
            if found is None:
                raise SystemExit("serve_load: the server did not start; its error is above")
            yield process, int(found[1])
        finally:
            process.terminate()


def ask_all(
    port: int, clients: int, requests: Sequence[tuple[str, str, bytes]], name: str
) -> list[tuple[int, float]]:
    """Status and seconds of each answer; every client keeps its connection. 599: the connection broke."""
    own = threading.local()

    def ask(request: tuple[str, str, bytes]) -> tuple[int, float]:
        path, content_type, body = request
        if not hasattr(own, "connection"):
            own.connection = http.client.HTTPConnection("127.0.0.1", port, timeout=120)
        began = time.perf_counter()
        try:
            own.connection.request("POST", path, body, {"Content-Type": content_type})
            answer = own.connection.getresponse()
            answer.read()
            return answer.status, time.perf_counter() - began
        except (OSError, http.client.HTTPException):
            own.connection.close()  # the next request opens it again
            return 599, time.perf_counter() - began

    with ThreadPoolExecutor(clients) as pool:
        return list(progress(pool.map(ask, requests), total=len(requests), unit=name))


def children(pid: int) -> list[int]:
    """Processes that a process has started: the workers, and one that keeps track of shared resources."""
    return sorted(map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split()))


def memory(pids: Sequence[int]) -> float:
    """Resident memory of processes together, MB."""
    page = os.sysconf("SC_PAGE_SIZE")
    return sum(int(Path(f"/proc/{pid}/statm").read_text().split()[1]) for pid in pids) * page / 1e6


def report(
    options: argparse.Namespace,
    alone: Sequence[float],
    answers: Sequence[tuple[int, float]],
    timed: Sequence[tuple[int, float]],
    seconds: float,
    statuses: Counter[int],
    memory_mb: tuple[float, float],
    survived: bool,
) -> int:
    """A table, and the numbers for programs; 1 where something went wrong."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column(f"{options.candidates} candidates, {options.workers} workers, {options.clients} clients")
    for header in ("requests/s", "p50 ms", "p99 ms"):
        table.add_column(header, justify="right")
    times = [spent for _, spent in timed]
    rows = {
        "server": (len(timed) / seconds, times),
        "plan alone, one thread": (len(alone) / sum(alone), alone),
    }
    for name, (rate, spent) in rows.items():
        shown = (1e3 * np.percentile(spent, share) for share in (50, 99))
        table.add_row(name, f"{rate:.1f}", *(f"{value:.0f}" for value in shown))
    Console(width=100).print(table)
    planned = Counter(status for status, _ in answers)
    broken = sum(n for status, n in statuses.items() if status >= 500) + len(answers) - planned[200]
    before, after = memory_mb
    result = {
        "requests_per_s": round(len(timed) / seconds, 2),
        "p50_ms": round(1e3 * float(np.percentile(times, 50)), 1),
        "p99_ms": round(1e3 * float(np.percentile(times, 99)), 1),
        "alone_p50_ms": round(1e3 * float(np.percentile(alone, 50)), 1),
        "alone_p99_ms": round(1e3 * float(np.percentile(alone, 99)), 1),
        "plans": len(answers),
        "answers_to_plans": {str(status): n for status, n in sorted(planned.items())},
        "malformed": options.malformed,
        "answers_to_malformed": {str(status): n for status, n in sorted(statuses.items())},
        "workers_survived": survived,
        "memory_mb": [round(before, 1), round(after, 1)],
        "memory_growth_mb_per_1000": round(1e3 * (after - before) / max(1, len(timed)), 2),
    }
    print(json.dumps(result))
    return 0 if survived and not broken else 1


if __name__ == "__main__":
    sys.exit(main())
