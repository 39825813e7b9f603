"""What the bound on the predicted quality refuses and saves. Run: python -m tests.benchmarks.refusal --help.

Plans without a bound and executes every grasp in the simulated cell: of validation parts, and of plates that
are wider than the hand opens. Then counts what the bound would have refused, and what had become of it.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np
import trimesh

from hal.errors import MotionAborted
from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.core.shipped import PRETRAINED, SIMULATED_CELL
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts.select_parts import part_names
from mskgrasp.parts.solids.solid import Solid
from mskgrasp.parts.write_solid import write_solid
from mskgrasp.planning.config import MIN_QUALITY, PlannerConfig
from mskgrasp.planning.for_cell import make_planner
from mskgrasp.planning.planner import Planner
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.progress import progress
from mskgrasp.trials.engine import TrialEngine, connected_engine
from tests.benchmarks.report import show

WIDE = ((0.095, 0.09, 0.03), (0.12, 0.1, 0.02), (0.13, 0.13, 0.04), (0.11, 0.11, 0.012))
"""Edges of plates, metres; each also as a disc of its first edge."""
BOUNDS = (0.3, MIN_QUALITY, 0.7)


@dataclass(frozen=True, kw_only=True)
class Tried:
    """A grasp of the best plan without a bound.

    Attributes:
        part: Name or folder.
        best: Best predicted quality of the shortlist, which the bound is compared with.
        outcome: ``lifted``, or the reason why not.
    """

    part: str
    best: float
    outcome: str


def wide_part(folder: Path, size: tuple[float, float, float], *, round_: bool) -> str:
    """Folder of a plate, or of a disc with 16 sides, that no hand of 80 mm opens over."""
    assert min(size[:2]) > MAX_OPENING
    name = f"{'disc' if round_ else 'plate'}_{1e3 * size[0]:.0f}x{1e3 * size[2]:.0f}"
    millimetres = 1e3 * np.array(size)
    mesh = (
        trimesh.creation.cylinder(millimetres[0] / 2, millimetres[2], sections=16)
        if round_
        else trimesh.creation.box(millimetres)
    )
    solid = Solid(mesh=mesh, hulls=(np.asarray(mesh.convex_hull.vertices),))
    with patch.dict(os.environ, XDG_CACHE_HOME=str(folder)):
        part = write_solid(
            solid, name=name, family="wide", source="benchmark", licence="Apache-2.0", density=2700.0,
            dimensions={}, recipe_hash="benchmark",
        )  # fmt: skip
    return str(part.folder)


def tried(engine: TrialEngine, planner: Planner, part: str, seed: int) -> Tried | None:
    """Plan without a bound and execute; None where no part is detected."""
    planned = engine.present(part, seed, planner)
    if planned.plan is None:
        return None
    plan = planned.plan
    done = engine.grasp(plan)
    if done.aborted:
        engine.recover(MotionAborted(done.aborted))
    best = float(plan.qualities[plan.shortlist].max())
    return Tried(part=part, best=best, outcome=done.reason or "lifted")


def row(name: str, bound: float, rows: list[Tried]) -> tuple[str, ...]:
    """A line of the table."""
    refused = [one for one in rows if one.best < bound]
    kept = [one for one in rows if one.best >= bound]
    lifted = sum(one.outcome == "lifted" for one in kept)
    outcomes = Counter(one.outcome for one in refused)
    return (
        name,
        f"{bound:g}",
        f"{len(refused)} of {len(rows)}",
        ", ".join(f"{outcome} {n}" for outcome, n in sorted(outcomes.items())) or "-",
        f"{sum(one.outcome == 'lifted' for one in rows)} of {len(rows)}",
        f"{lifted} of {len(kept)}",
        f"{min(one.best for one in rows):.2f} - {max(one.best for one in rows):.2f}",
    )


def main() -> None:
    """Prints a row a group and bound."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--parts", type=int, default=12, help="validation parts (default 12)")
    parser.add_argument("--trials", type=int, default=2, help="grasps of each part (default 2)")
    parser.add_argument("--out", type=Path, help="folder for report.json")
    options = parser.parse_args()
    models = load_models(PRETRAINED)
    groups: dict[str, list[Tried]] = {}
    with tempfile.TemporaryDirectory() as folder:
        names = {
            "validation parts": part_names(("validation",), models.meta.training, options.parts),
            "wider than the hand opens": [
                wide_part(Path(folder), size, round_=round_) for size in WIDE for round_ in (False, True)
            ],
        }
        picture = Path(folder) / "next.png"
        with connected_engine(SIMULATED_CELL, yes=True, picture=picture, tape=None) as engine:
            planner = make_planner(PRETRAINED, PlannerConfig(), engine.cell)
            for group, parts in names.items():
                tasks = [(part, seed) for part in parts for seed in range(options.trials)]
                found = (tried(engine, planner, *task) for task in progress(tasks, unit="grasp"))
                groups[group] = [one for one in found if one is not None]
    header = (
        "parts", "bound", "refused", "their outcomes without it", "lifted without it",
        "lifted of those tried", "best qualities",
    )  # fmt: skip
    rows = [row(group, bound, found) for group, found in groups.items() for bound in BOUNDS]
    show([Table(header=header, rows=rows)], options.out)


if __name__ == "__main__":
    main()
