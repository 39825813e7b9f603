"""Execution of one planned grasp and measurement of its displacement, by tracker or by tape."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hal import RgbdFrame, let_go, lower
from hal.errors import MotionAborted
from hal.execute import RELEASE
from mskgrasp.core.errors import MarkersNotFound
from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.perception.markers import check_between_pads, planar_displacement
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.trials.engine import PlannedGrasp, TrialEngine
from mskgrasp.trials.trial import Trial


@dataclass(frozen=True, kw_only=True)
class TrialRecord:
    """A trial with its frames and plan.

    Attributes:
        trial: The outcome.
        frame: The part at rest before the grasp.
        plan: None where no grasp was found.
        after: The part put down again, where it was captured to measure tape.
        in_hand: The hand still holds the part.
        aborted: Reason why the arm was stopped and must be recovered; empty where it was not.
    """

    trial: Trial
    frame: RgbdFrame
    plan: GraspPlan | None
    after: RgbdFrame | None = None
    in_hand: bool = False
    aborted: str = ""


def run_trial(
    engine: TrialEngine, planned: PlannedGrasp, *, part: str, number: int, seed: int
) -> TrialRecord:
    """Execute a planned grasp and measure it; `finish` then frees the hand.

    To measure tape, the part is put down where it was grasped and the arm moves home.

    Args:
        engine: Engine of the cell on which the part was presented.
        planned: Result of `TrialEngine.present`.
        part: Name of the part.
        number: Index of the trial among those of the part.
        seed: Seed of the scene.

    Raises:
        HalError: The cell was lost.
    """
    frame, plan = planned.frame, planned.plan
    trial = Trial(part=part, number=number, seed=seed, success=False, reason=planned.reason)
    if plan is None:
        trial = replace(trial, quality=planned.best_quality, refusal=planned.refusal)
        return TrialRecord(trial=trial, frame=frame, plan=None)
    done = engine.grasp(plan, planned.part)
    point = plan.view.centre_base
    if engine.tape is None and done.before is not None:
        point = np.asarray(done.before.position, dtype=np.float64)
    mean, covariance = plan.displacement_of(point)
    trial = replace(
        trial,
        success=not done.reason,
        reason=done.reason,
        grasp=plan.grasp.as_vector().tolist(),
        quality=plan.quality,
        planned_by=plan.planned_by,
        point_base=point.tolist(),
        predicted=mean.tolist(),
        predicted_std=np.sqrt(np.diag(covariance)).tolist(),
        planning_s=plan.seconds["total"],
        pose_base_obj=None if done.before is None else np.asarray(done.before.as_vector()).tolist(),
        tilt=done.tilt,
    )
    if done.reason:
        return TrialRecord(trial=trial, frame=frame, plan=plan, aborted=done.aborted)
    if engine.tape is None:
        if done.displacement is None:
            trial = replace(trial, unmeasured="no tracker: measure by tape (--measure markers)")
        else:
            trial = replace(trial, measured=done.displacement.tolist())
        return TrialRecord(trial=trial, frame=frame, plan=plan, in_hand=True)
    true = done.displacement_of_centre(plan)
    trial = replace(trial, true=None if true is None else true.tolist())
    assert done.result is not None  # it succeeded
    record = _measure_by_tape(engine, trial, frame, plan, done.result.width)
    if record.trial.unmeasured and planned.no_tape:
        return replace(record, trial=replace(record.trial, unmeasured=planned.no_tape))
    return record


def finish(engine: TrialEngine, record: TrialRecord) -> None:
    """Free the hand after a trial: recover from a contact, or put a lifted part down."""
    if record.aborted:
        engine.recover(MotionAborted(record.aborted))
    elif record.in_hand and record.plan is not None:
        engine.put_back(record.plan)


def _measure_by_tape(
    engine: TrialEngine, trial: Trial, frame: RgbdFrame, plan: GraspPlan, width: float
) -> TrialRecord:
    """Put the part down where it was grasped and measure its tape; implausible measurements are rejected."""
    after, in_hand = None, True
    try:
        before = engine.find_tape(frame)
        try:
            # To the grasp pose itself, since a dropped part shifts.
            lower(engine.cell, plan.grasp)
        except MotionAborted as error:
            engine.recover(error)
            raise MarkersNotFound("not put down: the part met the table above the grasp pose") from error
        in_hand = False
        try:
            opening = max(safe_opening(plan), min(width + RELEASE, MAX_OPENING))
            let_go(engine.cell, plan.grasp, opening=opening, tallest=engine.passed)
        except MotionAborted as error:
            engine.recover(error)
            raise MarkersNotFound("touched: the hand met something as it retracted") from error
        if not engine.leave():
            raise MarkersNotFound("touched: the hand met something on its way home")
        after = engine.capture()
        moved = planar_displacement(before, engine.find_tape(after), plan.grasp, plan.view.centre_base)
        centre_grasp = plan.grasp.T_base_grasp.inverse().apply(plan.view.centre_base)
        check_between_pads(moved, centre_grasp, width)
    except MarkersNotFound as error:
        return TrialRecord(
            trial=replace(trial, unmeasured=str(error)), frame=frame, plan=plan, after=after,
            in_hand=in_hand,
        )  # fmt: skip
    measured = [float(moved[0]), float(moved[1]), float("nan"), float(moved[2])]
    return TrialRecord(trial=replace(trial, measured=measured), frame=frame, plan=plan, after=after)


def safe_opening(plan: GraspPlan) -> float:
    """Compute the greatest opening at which the fingers clear the displaced part, metres.

    The fully open fingers cleared the undisplaced part. The displacement along the closing direction, plus
    two standard deviations, is subtracted on both sides; the turn is ignored.
    """
    aside = abs(plan.displacement[1]) + 2 * np.nan_to_num(plan.displacement_std[1])
    return max(0.0, MAX_OPENING - 2 * float(aside))
