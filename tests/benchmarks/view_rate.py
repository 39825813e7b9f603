"""Frames a second of the viewer in a headless browser that draws without a GPU, the view being turned.

python -m tests.benchmarks.view_rate [--candidates 3200] [--seconds 8]

The browser redraws only what changes, so that the view is turned with the mouse all the time. On a busy
machine the processor time of a frame says more than the rate.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from pathlib import Path

import numpy as np

from mskgrasp.core.grasp import Grasp
from mskgrasp.core.settings import REGION
from mskgrasp.view.page import Page
from mskgrasp.view.page_server import PageServer
from mskgrasp.view.scene import add_candidates, add_cloud, drawn_points
from tests import browser

WIDTH, HEIGHT = 900, 600
PIXELS = 160
"""Of the simulated camera's depth image, along a side."""
PART = 0.06
"""Length and width of the part, metres."""
COUNT = "window.frames_drawn = 0; (function next() { window.frames_drawn++; requestAnimationFrame(next); })()"


def processor_s(pid: int) -> float:
    """Processor time of a process and all its children so far, seconds."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        children = [
            int(child)
            for task in Path(f"/proc/{pid}/task").iterdir()
            for child in (task / "children").read_text().split()
        ]
    except FileNotFoundError:  # it has ended
        return 0.0
    own = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return own + sum(map(processor_s, children))


def measure(n_candidates: int, seconds: float) -> tuple[float, float]:
    """Frames a second, and processor seconds of the browser a frame."""
    rng = np.random.default_rng(0)
    vectors = rng.normal([0.5, 0.0, 0.02, 0.0], [0.02, 0.02, 0.005, 0.8], (n_candidates, 4))
    points = rng.uniform([0.33, -0.17, 0.0], [0.67, 0.17, 0.0], (PIXELS**2, 3))
    part = (np.abs(points[:, :2] - [0.5, 0.0]) < PART / 2).all(axis=1)
    points[part, 2] = PART / 2
    server = PageServer("127.0.0.1", 0, "benchmark")
    try:
        page = Page(server)
        add_candidates(page.scene, "/c", Grasp.from_vector(vectors), rng.uniform(size=n_candidates))
        drawn = drawn_points(points, REGION, 0.0)
        add_cloud(page.scene, "/p", points[drawn], (120, 120, 120), 0.0022)
        url = f"http://127.0.0.1:{server.get_port()}/"
        with browser.Page(url, width=WIDTH, height=HEIGHT, webgl=True) as shown:
            shown.wait_for("!!document.querySelector('canvas')")
            time.sleep(5)
            shown.evaluate(COUNT)
            shown.mouse("mousePressed", 300, 300)
            drawn, used, began = (
                shown.evaluate("window.frames_drawn"),
                processor_s(shown.pid),
                time.monotonic(),
            )
            while (passed := time.monotonic() - began) < seconds:
                shown.mouse("mouseMoved", 300 + 100 * math.sin(3 * passed), 300)
            frames = max(1, shown.evaluate("window.frames_drawn") - drawn)
            return frames / (time.monotonic() - began), (processor_s(shown.pid) - used) / frames
    finally:
        server.stop()


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.view_rate", description=__doc__)
    parser.add_argument("--candidates", type=int, default=3200)
    parser.add_argument("--seconds", type=float, default=8.0)
    options = parser.parse_args()
    rate, used = measure(options.candidates, options.seconds)
    scene = f"{options.candidates} candidates, {PIXELS} x {PIXELS} depth, {WIDTH} x {HEIGHT} pixels, no GPU"
    load = f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    print(f"{scene}: {rate:.1f} frames/s, {1e3 * used:.0f} ms of processor time a frame ({load})")


if __name__ == "__main__":
    main()
