"""What a narrower search of the planner loses and saves: python -m tests.benchmarks.search_breadth --help.

Plans a grasp in one image of each part with several numbers of recentred grasps and of grasps whose
displacement is predicted from all views, from the same candidates. Compared is the root of the chosen
grasp's score, the expected distance by which the part's points miss their place, with that of the widest
search, and the time of the selection.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from unittest.mock import patch

import numpy as np
import torch

from hal.open_cell import open_cell
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts.select_parts import part_names
from mskgrasp.planning import planner as search
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import present
from mskgrasp.runtime import cli
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.progress import progress
from tests.benchmarks.plan_speed import planner
from tests.benchmarks.report import show

WIDEST = (96, 64)
TRIED = (WIDEST, (48, 16), (48, 12), (48, 8), (32, 12), (24, 12), (12, 12))
"""Numbers of grasps recentred, and of those predicted from all views."""


def main() -> int:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument(
        "--parts", nargs="+", default=["validation:60"], help="as of evaluate (default: validation:60)"
    )
    parser.add_argument("--threads", type=int, default=2, help="of torch (default 2; 1 on a busy machine)")
    parser.add_argument("--out", type=Path, help="folder of report.json and report.md")
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    models = load_models(PRETRAINED)
    names = part_names(options.parts, models.meta.training)
    ours = planner(models, PlannerConfig())
    roots, seconds = np.zeros((2, len(names), len(TRIED)))
    with open_cell(Path("configs/cells/sapien.yaml")) as cell:
        for k, name in enumerate(progress(names, unit="part")):
            present(cell, name, k)
            frame = cell.camera.capture(5.0)
            for j, (recentred, promising) in enumerate(TRIED):
                with patch.multiple(search, RECENTRED=recentred, PROMISING=promising):
                    plan = ours.plan(frame, np.random.default_rng(k))
                roots[k, j], seconds[k, j] = np.sqrt(plan.score), plan.seconds["select"]
    ratio = roots / roots[:, [TRIED.index(WIDEST)]]
    rows = [
        (
            f"{recentred}", f"{promising}", f"{100 * (ratio[:, j].mean() - 1):.1f}%",
            f"{100 * (ratio[:, j].max() - 1):.1f}%", f"{1e3 * np.median(seconds[:, j]):.0f}",
        )
        for j, (recentred, promising) in enumerate(TRIED)
    ]  # fmt: skip
    header = ("recentred", "from all views", "greater on average", "at most", "select, ms")
    caption = f"Root of the score relative to the widest search, {len(names)} parts"
    show([Table(header=header, rows=rows, caption=caption)], options.out)
    return 0


if __name__ == "__main__":
    cli.run("search_breadth", main)
