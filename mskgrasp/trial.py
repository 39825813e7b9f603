"""One trial on any cell: present, look, plan, grasp, measure."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from hal import Cell, GraspResult, RgbdFrame, execute_grasp
from mskgrasp.geometry import Pose
from mskgrasp.grasp import EJECTED_DISTANCE, MIN_RISE, object_displacement, pose_base_tcp
from mskgrasp.planner import GraspPlan, Planner


@dataclass(frozen=True, kw_only=True)
class Trial:
    """What was planned and what came of it; poses in the base frame, displacements in the grasp frame.

    Attributes:
        part: Name of the part.
        number: Which trial of the part.
        seed: The part's place, its turn and the candidates follow from it.
        success: The part was lifted and held, as far as the cell can tell: the arm feels the gap of its
            fingers, a tracker sees how far the part has risen; neither sees contact or penetration.
        reason: Why not; empty where it was.
        grasp: (4,) the executed grasp; None, as all that follows, where no grasp was found.
        quality: Predicted.
        predicted: (4,) expected object displacement, metres and radians.
        predicted_std: (4,) its standard deviations; NaN where the model predicts none.
        measured: (4,) object displacement; None where not successful or nothing measures it.
        tilt: Measured tilt, radians, or None.
        planning_s: Seconds that planning took.
    """

    part: str
    number: int
    seed: int
    success: bool
    reason: str
    grasp: list[float] | None
    quality: float | None
    predicted: list[float] | None
    predicted_std: list[float] | None
    measured: list[float] | None
    tilt: float | None
    planning_s: float | None

    def to_json(self) -> dict[str, Any]:
        """Plain values; NaN (an unknown deviation) becomes None."""
        values = asdict(self)
        if self.predicted_std is not None:
            values["predicted_std"] = [v if np.isfinite(v) else None for v in self.predicted_std]
        return values

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Trial:
        """The trial that `to_json` wrote."""
        if values["predicted_std"] is not None:
            values["predicted_std"] = [np.nan if v is None else v for v in values["predicted_std"]]
        return cls(**values)


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
    if before is not None and after is not None:
        moved = after.position - before.position
        if result.holding and moved[2] >= MIN_RISE * lift:
            return ""
        if np.linalg.norm(moved[:2]) > EJECTED_DISTANCE:
            return "ejected"
        return "slipped" if result.lifted else "missed"
    if result.holding:
        return ""
    return "slipped" if result.lifted else "missed"
