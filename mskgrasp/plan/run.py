"""Program: look at the cell's table and plan one grasp. Run ``python -m mskgrasp.plan --help``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from pydantic import Field

from hal import open_cell
from mskgrasp.core.config import Config
from mskgrasp.learning.grasp_models import PRETRAINED
from mskgrasp.parts.importing.mesh_files import Unit
from mskgrasp.planning.for_cell import SIMULATED_CELL, make_planner, part_name, present
from mskgrasp.planning.planner import GraspPlan, PlannerConfig
from mskgrasp.reports.grasp_figures import draw_plan
from mskgrasp.runtime.cli import make_folder
from mskgrasp.runtime.options import parse

DESCRIPTION = """Takes a depth image of the cell and plans a precise grasp of the part in it.

Samples grasps over the part, keeps those of the best predicted quality, and chooses the one whose
displacement in the hand is best known. Nothing moves. Writes plan.png and plan.json.

A part of your own: python -m mskgrasp.plan --part my_bracket.stl"""


class PlanConfig(Config):
    """Settings of one planning."""

    models: Path = PRETRAINED
    """Folder with model.safetensors and model.json; by default the shipped one."""
    cell: Path = SIMULATED_CELL
    """YAML file of the cell; by default the simulated one."""
    out: Path = Path("out/plan")
    """Folder for plan.png and plan.json."""
    part: str | None = None
    """Lay this part (a name, a folder or a CAD file) on the table first; the cell needs a feeder."""
    unit: Unit | None = None
    """Of a CAD file's coordinates, where the format does not say; mm if not given."""
    seed: int = Field(default=0, ge=0)
    """Candidates, and the place of --part, follow from it."""
    planner: PlannerConfig = PlannerConfig()
    """How the grasp is chosen."""


def describe(plan: GraspPlan) -> str:
    """The plan in words, with units."""
    x, y, z, theta = plan.grasp
    mean, std = plan.displacement, plan.displacement_std
    shifts = ", ".join(
        f"{name} {value * 1e3:+.1f} +- {deviation * 1e3:.1f} mm"
        for name, value, deviation in zip(("dx", "dy", "dz"), mean[:3], std[:3], strict=True)
    )
    turn = f"dtheta {np.degrees(mean[3]):+.1f} +- {np.degrees(std[3]):.1f} deg"
    stages = ", ".join(f"{name} {value:.2f} s" for name, value in plan.seconds.items() if name != "total")
    return "\n".join(
        [
            f"grasp         x {x:.4f} m, y {y:.4f} m, z {z:.4f} m, theta {np.degrees(theta):.1f} deg (base)",
            f"quality       {plan.quality:.3f} (best of {len(plan.candidates)}: {plan.qualities.max():.3f})",
            f"displacement  {shifts}, {turn} (grasp frame)",
            f"planned in    {plan.seconds['total']:.2f} s ({stages})",
        ]
    )


def main() -> int:
    """Captures, plans, writes."""
    config = parse(PlanConfig, prog="python -m mskgrasp.plan", description=DESCRIPTION)
    part = None if config.part is None else part_name(config.part, config.unit)
    make_folder(config.out)
    with open_cell(config.cell) as cell:
        planner = make_planner(config.models, config.planner, cell)
        if part is not None:
            present(cell, part, config.seed)
        frame = cell.camera.capture()
        plan = planner.plan(frame, np.random.default_rng(config.seed))
    print(describe(plan))
    text = json.dumps(dict(plan.to_json(), seed=config.seed), indent=1, allow_nan=False)
    (config.out / "plan.json").write_text(text + "\n", encoding="utf-8")
    draw_plan(frame, plan, config.out / "plan.png")
    print(f"wrote {config.out / 'plan.json'} and {config.out / 'plan.png'}")
    return 0
