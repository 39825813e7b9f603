"""One trial on any cell: present, look, plan, grasp, measure."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from hal import Cell, GraspResult, RgbdFrame, execute_grasp
from mskgrasp.geometry import Pose
from mskgrasp.grasp import object_displacement, pose_base_tcp
from mskgrasp.planner import GraspPlan, Planner

MIN_RISE = 0.8
"""Least share of the lift that a held part must have risen (DESIGN: success)."""


@dataclass(frozen=True, kw_only=True)
class Trial:
    """What was planned and what came of it; poses in the base frame, displacements in the grasp frame.

    Attributes:
        part: Name of the part.
        number: Which trial of the part.
        seed: The part's place, its turn and the candidates follow from it.
        success: The part was lifted and held.
        reason: Why not; empty where it was.
        grasp: (4,) the executed grasp.
        quality: Predicted.
        predicted: (4,) expected object displacement, metres and radians.
        predicted_std: (4,) its standard deviations.
        measured: (4,) object displacement; None where not successful or nothing measures it.
        tilt: Measured tilt, radians, or None.
        planning_s: Seconds that planning took.
    """

    part: str
    number: int
    seed: int
    success: bool
    reason: str
    grasp: list[float]
    quality: float
    predicted: list[float]
    predicted_std: list[float]
    measured: list[float] | None
    tilt: float | None
    planning_s: float

    def to_json(self) -> dict[str, Any]:
        """Plain values; NaN (an unknown deviation) becomes None."""
        values = asdict(self)
        values["predicted_std"] = [v if np.isfinite(v) else None for v in self.predicted_std]
        return values


def run_trial(
    cell: Cell, planner: Planner, *, part: str, number: int, seed: int
) -> tuple[Trial, RgbdFrame, GraspPlan]:
    """Looks, plans and grasps; the part lies on the table already, the arm is at home.

    Raises:
        NoPartFound, NoGraspFound: There is nothing to grasp.
        HalError: The cell was lost.
    """
    frame = cell.camera.capture()
    plan = planner.plan(frame, np.random.default_rng(seed))
    before = cell.tracker.part_pose() if cell.tracker is not None else None
    result = execute_grasp(cell, plan.grasp)
    after = cell.tracker.part_pose() if cell.tracker is not None else None
    reason = _failure(result, before, after, cell.workspace.lift_height)
    measured, tilt = None, None
    if not reason and before is not None and after is not None:
        displacement, swing = object_displacement(
            pose_base_tcp(plan.grasp).inverse() @ before, result.T_base_tcp.inverse() @ after
        )
        measured, tilt = displacement.tolist(), float(swing)
    trial = Trial(
        part=part,
        number=number,
        seed=seed,
        success=not reason,
        reason=reason,
        grasp=plan.grasp.tolist(),
        quality=plan.quality,
        predicted=plan.displacement.tolist(),
        predicted_std=plan.displacement_std.tolist(),
        measured=measured,
        tilt=tilt,
        planning_s=plan.seconds["total"],
    )
    return trial, frame, plan


def _failure(result: GraspResult, before: Pose | None, after: Pose | None, lift: float) -> str:
    if result.aborted is not None:
        return "collided"
    if not result.lifted:
        return "missed"
    if not result.holding:
        return "slipped"
    if before is not None and after is not None:
        if after.position[2] - before.position[2] < MIN_RISE * lift:
            return "slipped"
    return ""
