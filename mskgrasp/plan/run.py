"""Plan of one grasp on a cell, written and described."""

from __future__ import annotations

import json

import numpy as np

from hal import Cell, capture_at_home, go_home, open_cell
from hal.operator import Operator, StoppedByOperator
from mskgrasp.core.errors import UsageError
from mskgrasp.core.files import write_whole
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts import find_part
from mskgrasp.plan.config import PlanConfig
from mskgrasp.planning.certified_planner import planner_of_part
from mskgrasp.planning.for_cell import make_planner, part_name, present, tell_model
from mskgrasp.planning.grasp_figures import draw_plan
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.runtime.cli import make_folder


def _go_home(cell: Cell, operator: Operator) -> None:
    """Move the arm home, with the consent of the operator of a real one.

    Raises:
        StoppedByOperator: The operator does not want it to move.
    """
    if not operator.confirm("The arm moves home, out of the camera's view. May it move? y: yes, n: no: "):
        raise StoppedByOperator("stopped by the operator; nothing moved")
    go_home(cell, take=operator.take)


def plan_grasp(config: PlanConfig) -> GraspPlan:
    """Plan one grasp of the part on the cell's table and write plan.json and plan.png.

    Raises:
        MskgraspError: The cell, the part or the model cannot be used, or no grasp was found.
    """
    if config.planner.policy == "certified" and config.part is None:
        raise UsageError("--planner.policy certified needs the part on the table: --part NAME")
    load_models(config.models)  # refused before a part is imported or a cell opened
    part = None if config.part is None else part_name(config.part, config.unit)
    if config.unit is not None and part is None:
        raise UsageError("--unit is for a CAD file in --part; omit it")
    known = None if part is None else find_part(part)
    make_folder(config.out)
    with open_cell(config.cell) as cell:
        if known is not None:
            cell.arm.check_load(known.mass)
        planner = make_planner(config.models, config.planner, cell)
        tell_model(planner.models, cell)
        by_hand = config.planner.policy == "certified" and cell.feeder is None
        if part is not None and not by_hand:
            present(cell, part, config.seed)
        if config.go_home:
            _go_home(cell, Operator(cell))
        frame = capture_at_home(cell)
        chooser = planner if known is None else planner_of_part(planner, cell, known)
        plan = chooser.plan(frame, np.random.default_rng(config.seed))
    text = json.dumps(dict(plan.to_json(), seed=config.seed), indent=1, allow_nan=False)
    write_whole(config.out / "plan.json", (text + "\n").encode())
    draw_plan(frame, plan, config.out / "plan.png")
    return plan
