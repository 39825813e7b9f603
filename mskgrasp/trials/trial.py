"""One trial on any cell: look, plan, grasp, measure how the part moved in the hand."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal, Protocol

import numpy as np

from hal import Cell, GraspResult, RgbdFrame, execute_grasp, go_home, let_go, lower, put_down
from hal.errors import MotionAborted, OutOfWorkspace, Stopped
from mskgrasp.core.errors import MarkersNotFound, NoGraspFound, NoPartFound
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import (
    EJECTED_DISTANCE,
    MAX_OPENING,
    MIN_RISE,
    centre_in_grasp_frame,
    object_displacement,
    pose_base_tcp,
)
from mskgrasp.core.settings import Tape
from mskgrasp.dataset import DEPTH_UNIT, depth_to_u16, u16_to_depth
from mskgrasp.perception.markers import Markers, check_between_pads, find_markers, planar_displacement
from mskgrasp.planning.planner import GraspPlan

Policy = Literal["quality", "low_variance"]
Recover = Callable[[str], None]
"""Lets an arm move again that stopped for the reason given."""
_MOST_DEPTH = np.iinfo(np.uint16).max * DEPTH_UNIT
_LEGAL_KEY = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")


class PlansGrasps(Protocol):
    """Whatever chooses a grasp in a frame: `mskgrasp.planning.planner.Planner`, or another."""

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> GraspPlan:
        """Plans a grasp of the part that a frame shows."""
        ...


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """What a model expects of a grasp: object displacement, axes of the grasp frame, metres and radians.

    Attributes:
        mean: (4,).
        std: (4,) standard deviations; NaN where the model predicts none.
    """

    mean: list[float]
    std: list[float]


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
        measured: (4,) object displacement; None where not successful or not measured. Of markers, dz is NaN:
            they tell the motion in the plane.
        tilt: Measured tilt, radians, or None.
        planning_s: Seconds that planning took.
        family: Kind of part.
        policy: How the grasp was chosen.
        chosen_by: Label of the model whose variances chose it; empty where there is but one.
        unmeasured: Why a success was not measured; empty where it was.
        true: (4,) what a tracker says where markers measure: the displacement of the very point whose motion
            they measure, the part's seen centre; None where nothing knows.
        pose_base_obj: (7,) x y z qw qx qy qz of the part before the grasp, where a tracker tells it.
        predictions: What other models expect of this grasp, by label.
    """

    part: str
    number: int
    seed: int
    success: bool
    reason: str
    grasp: list[float] | None = None
    quality: float | None = None
    predicted: list[float] | None = None
    predicted_std: list[float] | None = None
    measured: list[float] | None = None
    tilt: float | None = None
    planning_s: float | None = None
    family: str = ""
    policy: Policy = "low_variance"
    chosen_by: str = ""
    unmeasured: str = ""
    true: list[float] | None = None
    pose_base_obj: list[float] | None = None
    predictions: dict[str, Prediction] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """Names the trial in its run, for people and for files."""
        return trial_key(self.part, self.number, self.chosen_by)

    def to_json(self) -> dict[str, Any]:
        """Plain values; NaN (an unknown deviation, a dz that nothing measured) becomes None."""
        return _nan_to_none(asdict(self))

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Trial:
        """The trial that `to_json` wrote.

        Raises:
            TypeError, ValueError, KeyError: The values are no trial.
        """
        values = dict(values)
        for name in ("predicted_std", "measured"):
            values[name] = _none_to_nan(values[name])
        values["predictions"] = {
            str(label): Prediction(mean=list(one["mean"]), std=_none_to_nan(one["std"]) or [])
            for label, one in values.get("predictions", {}).items()
        }
        trial = cls(**values)
        if not _LEGAL_KEY.fullmatch(trial.key):
            raise ValueError(trial.key)
        return trial


def trial_key(part: str, number: int, chosen_by: str = "") -> str:
    """``<part>-<number>``, and ``-<model>`` where a model's variances chose the grasp."""
    return f"{part}-{number:03d}" + (f"-{chosen_by}" if chosen_by else "")


@dataclass(frozen=True, kw_only=True)
class TrialRecord:
    """A trial and what it was made from.

    Attributes:
        trial: What came of it.
        frame: The part before the grasp, with the depth as it is stored: in steps of 0.1 mm.
        plan: None where no grasp was found.
        after: The part put down again, where markers were looked for.
        in_hand: The hand holds the part still.
    """

    trial: Trial
    frame: RgbdFrame
    plan: GraspPlan | None
    after: RgbdFrame | None = None
    in_hand: bool = False


def run_trial(
    cell: Cell,
    planner: PlansGrasps,
    *,
    part: str,
    number: int,
    seed: int,
    tape: Tape | None = None,
    may_move: Callable[[RgbdFrame, GraspPlan], bool] | None = None,
    recover: Recover | None = None,
) -> TrialRecord | None:
    """Looks, plans, grasps and measures; the part lies on the table already, the arm is at home.

    Args:
        cell: Connected.
        planner: Chooses the grasp.
        part: Name of the part, for the record.
        number: Which trial of it, for the record.
        seed: The candidates follow from it.
        tape: Measure by squares of tape of these sizes: the part is put down where it was grasped, and the
            arm goes home. None: by the cell's tracker.
        may_move: Is asked once the grasp is planned; None: the arm moves.
        recover: Lets the arm move again after a contact; by default at once.

    Returns:
        None where the arm may not move.

    Raises:
        HalError: The cell was lost.
    """
    frame = _as_stored(cell.camera.capture())
    trial = Trial(part=part, number=number, seed=seed, success=False, reason="")
    try:
        plan = planner.plan(frame, np.random.default_rng(seed))
    except (NoPartFound, NoGraspFound) as error:
        return TrialRecord(trial=replace(trial, reason=type(error).__name__), frame=frame, plan=None)
    if may_move is not None and not may_move(frame, plan):
        return None
    before = cell.tracker.part_pose() if cell.tracker is not None else None
    trial = replace(
        trial,
        grasp=plan.grasp.tolist(),
        quality=plan.quality,
        predicted=plan.displacement.tolist(),
        predicted_std=plan.displacement_std.tolist(),
        planning_s=plan.seconds["total"],
        pose_base_obj=None if before is None else np.asarray(before.as_vector()).tolist(),
    )
    try:
        result = execute_grasp(cell, plan.grasp)
    except OutOfWorkspace as error:
        return TrialRecord(trial=replace(trial, reason=type(error).__name__), frame=frame, plan=plan)
    after = cell.tracker.part_pose() if cell.tracker is not None else None
    reason = _failure(result, before, after, cell.workspace.lift_height)
    trial = replace(trial, success=not reason, reason=reason)
    if not reason and before is not None and after is not None:
        displacement, swing = object_displacement(
            pose_base_tcp(plan.grasp).inverse() @ before, result.T_base_tcp.inverse() @ after
        )
        trial = replace(trial, measured=displacement.tolist(), tilt=float(swing))
    if reason or tape is None:
        if trial.success and trial.measured is None:
            trial = replace(trial, unmeasured="no tracker: measure by tape (--measure markers)")
        return TrialRecord(trial=trial, frame=frame, plan=plan, in_hand=trial.success)
    if trial.measured is not None and before is not None:
        true = _of_seen_centre(np.array(trial.measured), before, plan)
        trial = replace(trial, true=true.tolist(), measured=None)
    return _measure_by_tape(cell, tape, trial, frame, plan, result.width, recover)


def _of_seen_centre(displacement: np.ndarray, before: Pose, plan: GraspPlan) -> np.ndarray:
    """The displacement (4,) of the part's seen centre, from that of its origin; its tilt is left out."""
    origin, centre = (
        centre_in_grasp_frame(point, plan.grasp)[:2] for point in (before.position, plan.view.centre_base)
    )
    (x, y), cos, sin = centre - origin, np.cos(displacement[3]), np.sin(displacement[3])
    return displacement + np.array([cos * x - sin * y - x, sin * x + cos * y - y, 0.0, 0.0])


def _measure_by_tape(
    cell: Cell,
    tape: Tape,
    trial: Trial,
    frame: RgbdFrame,
    plan: GraspPlan,
    width: float,
    recover: Recover | None,
) -> TrialRecord:
    """Puts the part down where it was grasped and looks how it lies; whatever is in doubt is no number."""

    def look(at: RgbdFrame) -> Markers:
        return find_markers(at, tape, table_z=cell.workspace.table_z, region=cell.workspace.region)

    after, in_hand = None, True
    try:
        before = look(frame)
        try:
            # To the very place: where it falls, it shifts.
            lower(cell, plan.grasp)
        except MotionAborted as error:
            _recover(cell, error, recover)
            raise MarkersNotFound("not put down: the part hangs lower in the hand than it lay") from error
        in_hand = False
        try:
            let_go(cell, plan.grasp, opening=room(plan))
        except MotionAborted as error:
            _recover(cell, error, recover)
            raise MarkersNotFound("touched: the hand met something as it let go and rose") from error
        clear(cell, recover)
        after = _as_stored(cell.camera.capture())
        moved = planar_displacement(before, look(after), plan.grasp, plan.view.centre_base)
        check_between_pads(moved, centre_in_grasp_frame(plan.view.centre_base, plan.grasp), width)
    except MarkersNotFound as error:
        return TrialRecord(
            trial=replace(trial, unmeasured=str(error)), frame=frame, plan=plan, after=after,
            in_hand=in_hand,
        )  # fmt: skip
    measured = [float(moved[0]), float(moved[1]), float("nan"), float(moved[2])]
    return TrialRecord(trial=replace(trial, measured=measured), frame=frame, plan=plan, after=after)


def room(plan: GraspPlan) -> float:
    """How far the fingers may open about the part once it is displaced as planned, metres.

    They had room on the way down when open all the way; the part is since then nearer to one of them. Its
    turn is left out.
    """
    aside = abs(plan.displacement[1]) + 2 * np.nan_to_num(plan.displacement_std[1])
    return max(0.0, MAX_OPENING - 2 * float(aside))


def _as_stored(frame: RgbdFrame) -> RgbdFrame:
    """The frame as a file holds it, in the datasets' steps: what is planned on can be planned on again."""
    depth = np.where(frame.depth > _MOST_DEPTH, np.nan, frame.depth)
    return replace(frame, depth=u16_to_depth(depth_to_u16(depth)))


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


def finish(cell: Cell, record: TrialRecord, recover: Recover | None = None) -> None:
    """Puts a lifted part down again; after a contact the arm may move on, the trial is over."""
    if record.trial.reason == "collided":
        _recover(cell, MotionAborted("it met something on its way to the grasp, or with the part"), recover)
    elif record.in_hand and record.plan is not None:
        try:
            put_down(cell, record.plan.grasp)
        except MotionAborted as error:
            _recover(cell, error, recover)


def _recover(cell: Cell, error: MotionAborted, recover: Recover | None) -> None:
    if isinstance(error, Stopped):
        raise error
    if recover is None:
        cell.arm.recover()
    else:
        recover(str(error))


def clear(cell: Cell, recover: Recover | None = None) -> None:
    """Brings the arm home, out of the camera's sight; after a contact on the way it tries once more.

    Raises:
        MotionAborted: Something still holds it.
    """
    try:
        go_home(cell)
    except MotionAborted as error:
        _recover(cell, error, recover)
        go_home(cell)


def _nan_to_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _nan_to_none(one) for name, one in value.items()}
    if isinstance(value, list):
        return [_nan_to_none(one) for one in value]
    return None if isinstance(value, float) and np.isnan(value) else value


def _none_to_nan(values: list[float | None] | None) -> list[float] | None:
    return None if values is None else [float("nan") if value is None else float(value) for value in values]
