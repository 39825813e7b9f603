"""Steps of a trial on any cell: presentation, capture, planning, grasping, measurement, recovery."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
import torch

from hal import (
    Cell,
    GraspResult,
    RgbdFrame,
    capture_at_home,
    cell_from_yaml,
    execute_grasp,
    go_home,
    put_down,
)
from hal.errors import MotionAborted, OutOfWorkspace, Stopped
from hal.execute import refuse_by_hand
from hal.operator import Operator
from mskgrasp.core.errors import GraspRefused, NoGraspFound, NoPartFound, TapeDoesNotFit
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import (
    EJECTED_DISTANCE,
    MIN_RISE,
    PartView,
    object_displacement,
    swing_in_hand,
)
from mskgrasp.core.settings import Region, Tape
from mskgrasp.dataset import DEPTH_UNIT, depth_to_u16, u16_to_depth
from mskgrasp.parts import Part, find_part
from mskgrasp.perception.markers import Markers, find_markers
from mskgrasp.perception.tallest import tallest_thing
from mskgrasp.planning.grasp_figures import draw_plan
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.planning.place_pose import displacement_of_point
from mskgrasp.trials.trial import REFUSED, reason_of

_MAX_DEPTH = np.iinfo(np.uint16).max * DEPTH_UNIT


class PlansGrasps(Protocol):
    """Interface of planners, such as `mskgrasp.planning.planner.Planner`."""

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> GraspPlan:
        """Plan a grasp of the part in a frame."""
        ...


@dataclass(frozen=True, kw_only=True)
class PlannedGrasp:
    """Captured part and the grasp planned for it.

    Attributes:
        frame: The part at rest before the grasp.
        plan: None where no grasp was found.
        part: The part, whose mass and centre are stated to the arm; None: an unknown one.
        reason: Reason where no grasp was found: `REFUSED`, or `reason_of` the error; else empty.
        best_quality: Best predicted quality where all grasps were refused; else None.
        refusal: Why they were, in a line; else empty.
        no_tape: Reason why the part carries no tape although tape measures; else empty.
    """

    frame: RgbdFrame
    plan: GraspPlan | None
    part: Part | None = None
    reason: str = ""
    no_tape: str = ""
    best_quality: float | None = None
    refusal: str = ""


@dataclass(frozen=True, kw_only=True)
class ExecutedGrasp:
    """Outcome of an executed grasp.

    Attributes:
        reason: Reason why the part was not lifted and held; empty where it was.
        result: Measurements of the arm; None where a pose or the way to one is outside its workspace, before
            anything moved or later (`hal.execute_grasp`).
        before: ``T_base_obj`` before the grasp; None without a tracker.
        displacement: (4,) object displacement; None where the grasp failed or without a tracker.
        swing: (2,) swing of the part in the hand, radians about x and y of the grasp frame; None as before.
    """

    reason: str
    result: GraspResult | None = None
    before: Pose | None = None
    displacement: np.ndarray | None = None
    swing: np.ndarray | None = None

    @property
    def tilt(self) -> float | None:
        """Tilt of the part in the hand, radians; None where the swing is."""
        return None if self.swing is None else float(np.linalg.norm(self.swing))

    @property
    def aborted(self) -> str:
        """Reason why the arm was stopped and must be recovered; empty where it was not."""
        return "" if self.result is None else self.result.aborted or ""

    def displacement_of_centre(self, plan: GraspPlan) -> np.ndarray | None:
        """Displacement (4,) of the part's detected centre; the tilt is ignored."""
        if self.displacement is None or self.before is None:
            return None
        origin, centre = (
            plan.grasp.T_base_grasp.inverse().apply(point)
            for point in (self.before.position, plan.view.centre_base)
        )
        return displacement_of_point(self.displacement, origin, centre)


class TrialEngine:
    """Steps of all trials on a connected cell.

    Args:
        cell: The connected cell.
        operator: Confirms motions and recoveries, if the cell asks an operator.
        picture: File for the picture of the planned grasp that the operator confirms.
        tape: Sizes of the tape squares that measure; None: the cell's tracker measures, if it has one.
    """

    def __init__(
        self,
        cell: Cell,
        operator: Operator,
        *,
        picture: Path = Path("next.png"),
        tape: Tape | None = None,
    ):
        self.cell = cell
        self.tape = tape
        self._operator = operator
        self._picture = picture
        self._tallest = 0.0

    def home(self) -> None:
        """Move the arm home, out of the camera's view; after a contact, recover and try once more.

        Raises:
            MotionAborted: A second contact.
        """
        try:
            go_home(self.cell, tallest=self._tallest, take=self._operator.take)
        except MotionAborted as error:
            self.recover(error)
            go_home(self.cell, tallest=self._tallest, take=self._operator.take)

    def leave(self) -> bool:
        """Move the arm home as `home` does; a part that hooks on a finger is left to the feeder, if any.

        Returns:
            Whether the arm is at home.

        Raises:
            MotionAborted: A second contact, and the cell has no feeder.
        """
        try:
            self.home()
        except MotionAborted as error:
            if self.cell.feeder is None:
                raise
            self.recover(error)
            return False
        return True

    @property
    def _feeder_resets(self) -> bool:
        """Whether the feeder itself empties the hand and puts the arm home."""
        return self.cell.arm.simulated and self.cell.feeder is not None

    def recover(self, error: MotionAborted) -> None:
        """Recover the arm after a contact, with the operator's consent where one is asked.

        Raises:
            Stopped: The arm was stopped by a person.
            StoppedByOperator: The operator ended the run.
        """
        if isinstance(error, Stopped):
            raise error
        self._operator.recover(self.cell, str(error))

    def capture(self) -> RgbdFrame:
        """Capture a frame with depth rounded as in a file, so that a stored trial can be planned again.

        The hand then passes over the tallest thing in it.

        Raises:
            ArmInView: The arm is not at home.
        """
        frame = capture_at_home(self.cell)
        self._tallest = self.tallest(frame)
        depth = np.where(frame.depth > _MAX_DEPTH, np.nan, frame.depth)
        return replace(frame, depth=u16_to_depth(depth_to_u16(depth)))

    @property
    def passed(self) -> float:
        """Height over the table of the tallest thing in the last frame, metres."""
        return self._tallest

    def tallest(self, frame: RgbdFrame, beside: PartView | None = None) -> float:
        """Height over the table of the tallest thing in a frame, metres.

        Args:
            frame: Captured with the arm at home.
            beside: A part that does not count; None: all do.
        """
        limits = self.cell.arm.limits
        return tallest_thing(
            frame, table_z=self.cell.workspace.table_z, lower=limits.box_lower, upper=limits.box_upper,
            beside=beside,
        )  # fmt: skip

    def present(
        self,
        part: str,
        seed: int,
        planner: PlansGrasps,
        *,
        name: str = "",
        keep: bool = False,
        then: str = "",
    ) -> PlannedGrasp:
        """Have a part placed on the table, capture it and plan its grasp.

        Where an operator is asked, repeat until a grasp is planned and confirmed.

        Args:
            part: Name or folder.
            seed: Determines a feeder's placement and the candidates.
            planner: Plans the grasp.
            name: Title of the trial for the operator.
            keep: Parts outside the region stay, as on a pallet.
            then: Motion after the grasp, in words for the operator.

        Raises:
            NotCalibrated: The camera's pose was measured by hand; nothing moves.
            LoadTooHeavy: The arm cannot carry the part; nothing moves.
            HalError: The cell was lost.
            StoppedByOperator: The operator ended the run.
        """
        refuse_by_hand(self.cell)
        known = find_part(part)
        self.cell.arm.check_load(known.mass)
        while True:
            if keep or not self._feeder_resets:
                self.leave()
            no_tape = ""
            try:
                self._operator.present(self.cell, part, seed, name=name, keep=keep)
            except TapeDoesNotFit as error:
                no_tape = f"no room for tape: {error}"  # the part is on the table and can be grasped
            frame = self.capture()
            try:
                plan = planner.plan(frame, np.random.default_rng(seed))
            except (NoPartFound, NoGraspFound) as error:
                quality = error.quality if isinstance(error, GraspRefused) else None
                if self._operator.asks:
                    again = "; place the part again" if quality is None else ""
                    self._operator.inform(f"no grasp was planned: {error}{again}")
                    if quality is None or self._operator.confirm(
                        "Place the part again? y: yes, n: no, go on without it, q: stop: "
                    ):
                        continue
                reason = reason_of(type(error)) if quality is None else REFUSED
                return PlannedGrasp(
                    frame=frame, plan=None, part=known, reason=reason, no_tape=no_tape, best_quality=quality,
                    refusal="" if quality is None else str(error),
                )  # fmt: skip
            if self._operator.asks:
                draw_plan(frame, plan, self._picture)
            if self._operator.may_move(self._picture, f"{plan.summary}; {then}" if then else plan.summary):
                return PlannedGrasp(frame=frame, plan=plan, part=known, no_tape=no_tape)

    def grasp(self, plan: GraspPlan, part: Part | None = None) -> ExecutedGrasp:
        """Execute a planned grasp and measure the displacement by the cell's tracker, if it has one.

        Args:
            plan: The grasp.
            part: The part, whose weight the arm compensates once it holds it; None where it is not known.

        Raises:
            LoadTooHeavy: The arm cannot carry the part; nothing moved.
            HalError: The cell was lost.
        """
        before = self.part_pose()
        try:
            load = None if part is None else plan.load_of(part)
            result = execute_grasp(self.cell, plan.grasp, tallest=self._tallest, load=load)
        except OutOfWorkspace as error:
            return ExecutedGrasp(reason=reason_of(type(error)), before=before)
        after = self.part_pose()
        reason = _failure(result, before, after, self.cell.workspace.lift_height)
        if reason or before is None or after is None:
            return ExecutedGrasp(reason=reason, result=result, before=before)
        held = plan.grasp.T_base_tcp.inverse() @ before, result.T_base_tcp.inverse() @ after
        displacement, _ = object_displacement(*held)
        return ExecutedGrasp(
            reason="",
            result=result,
            before=before,
            displacement=np.asarray(displacement),
            swing=np.asarray(swing_in_hand(*held)),
        )

    def put_back(self, plan: GraspPlan) -> None:
        """Put a lifted part down where it was grasped; a contact ends this motion, not the trial.

        Not where a simulated feeder clears the hand as it places the next part.
        """
        if self._feeder_resets:
            return
        try:
            put_down(self.cell, plan.grasp, tallest=self._tallest)
        except MotionAborted as error:
            self.recover(error)

    def part_pose(self) -> Pose | None:
        """``T_base_obj`` by the cell's tracker; None where it has none."""
        return None if self.cell.tracker is None else self.cell.tracker.part_pose()

    def find_tape(self, frame: RgbdFrame, region: Region | None = None) -> Markers:
        """Find both tape squares in a frame.

        Args:
            frame: Captured with the arm at home.
            region: Region of the part; None: the cell's region.

        Raises:
            MarkersNotFound: A square is not detected.
        """
        assert self.tape is not None
        workspace = self.cell.workspace
        return find_markers(
            frame, self.tape, table_z=workspace.table_z, region=workspace.region if region is None else region
        )


@contextmanager
def connected_engine(path: Path, *, yes: bool, picture: Path, tape: Tape | None) -> Iterator[TrialEngine]:
    """Connect the cell of a YAML file until the end of the block.

    Raises:
        UsageError: An operator must be asked, but standard input is not a terminal.
        HalError: The cell cannot be connected.
    """
    cell = cell_from_yaml(path)
    operator = Operator(cell, yes=yes)
    n_threads = torch.get_num_threads()
    if cell.arm.simulated:
        # A simulator collects garbage at every new scene; the modules loaded by now need no scan.
        gc.collect()
        gc.freeze()
        # Rounding depends on the number of threads, and would reorder near-equal grasps.
        torch.set_num_threads(1)
    try:
        with cell.connected():
            yield TrialEngine(cell, operator, picture=picture, tape=tape)
    finally:
        torch.set_num_threads(n_threads)


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
