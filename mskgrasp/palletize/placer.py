"""One part put down once, on any cell: lay it, look, plan, grasp, correct, place, measure."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hal import Cell, RgbdFrame, execute_grasp, go_home, put_down
from hal.errors import MotionAborted, OutOfWorkspace, Stopped
from hal.operator import Operator
from mskgrasp.core.errors import MarkersNotFound, NoGraspFound, NoPartFound, TapeDoesNotFit
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import centre_in_grasp_frame, object_displacement, pose_base_tcp
from mskgrasp.core.settings import Region, Tape
from mskgrasp.palletize.figures import draw_placement, pallet_image
from mskgrasp.palletize.placements import Correction, Placement
from mskgrasp.palletize.slots import SEEN_TOLERANCE, Slot, first_reachable
from mskgrasp.palletize.views import take_views, write_views
from mskgrasp.parts import find_part
from mskgrasp.perception.footprint import seen_footprint
from mskgrasp.perception.markers import find_markers, planar_displacement
from mskgrasp.planning.placing import Target, displacement_of_point, place, place_error, place_pose, turned_by
from mskgrasp.planning.planner import GraspPlan, Planner
from mskgrasp.reports.grasp_figures import draw_plan

_NEAR = 0.001
"""Half a side of the region in which a placed part's tape is sought, m; `find_markers` adds its margin."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """A part to be put into a slot.

    Attributes:
        part: Name or folder.
        number: Which trial of the part, or which pallet.
        index: Of the slot, from 0.
        slot: Where it goes.
        correction: What is corrected by.
        seed: Its place and turn, and the planner's candidates, follow from it.
        keep: What lies on the pallet stays there.
    """

    part: str
    number: int
    index: int
    slot: Slot
    correction: Correction
    seed: int
    keep: bool

    @property
    def key(self) -> tuple[str, int, int, Correction]:
        """As `Placement.key`."""
        return find_part(self.part).name, self.number, self.index, self.correction


class Placer:
    """Puts parts down on a connected cell.

    Args:
        cell: Connected.
        planner: For it.
        operator: Is asked before the arm moves, where anybody is.
        pictures: Folder for the picture and the views of every placement.
        tape: Squares of tape on the parts to measure by; None: the cell's tracker, where it has one.
    """

    def __init__(
        self, cell: Cell, planner: Planner, operator: Operator, pictures: Path, *, tape: Tape | None = None
    ):
        self._cell = cell
        self._planner = planner
        self._operator = operator
        self._pictures = pictures
        self._tape = tape
        self._tops: dict[int, float] = {}
        self._last: tuple[int, np.ndarray, GraspPlan] | None = None

    def run(self, task: Task, name: str = "") -> Placement:
        """Puts one part down and measures it; writes its picture.

        Args:
            task: What to do.
            name: The same for the operator, such as "placement 3 of 20".

        Raises:
            HalError: The cell was lost; nothing of this placement is kept.
            StoppedByOperator: The operator said so.
        """
        failed = Placement(
            part=find_part(task.part).name, number=task.number, slot=task.index, correction=task.correction,
            target=(task.slot.x, task.slot.y, task.slot.theta), placed=False, reason="",
        )  # fmt: skip
        while True:
            self.home()
            # It lies there all the same; without tape its error is unmeasured, which is said below.
            with contextlib.suppress(TapeDoesNotFit):
                self._operator.present(self._cell, task.part, task.seed, name=name, keep=task.keep)
            frame = self._cell.camera.capture()
            try:
                plan = self._plan(frame, task.seed)
            except (NoPartFound, NoGraspFound) as error:
                if self._operator.asks:
                    self._operator.inform(str(error))
                    continue
                return replace(failed, reason=type(error).__name__)
            if self._agreed(frame, plan, task):
                break
        known = replace(failed, grasp=plan.grasp.tolist(), predicted=plan.displacement.tolist())
        workspace = self._cell.workspace
        footprint = seen_footprint(
            frame, table_z=workspace.table_z, region=workspace.region, min_height=workspace.min_height
        )
        if not task.slot.fits(footprint, SEEN_TOLERANCE):
            return replace(known, reason="slot too small")
        targets = task.slot.targets(footprint)
        done, target, after = self._carry(frame, plan, targets, known)
        if not task.keep:
            self._tops = {}
        if done.placed:
            self._tops[task.index] = float(plan.view.size[2])
        views = take_views(frame, after, plan, target, task.slot.theta)
        write_views(views, self._pictures / f"{done.name}.npz")
        draw_placement(views, done, self._pictures / f"{done.name}.png")
        return done

    def home(self) -> None:
        """Brings the arm home, out of the camera's sight; after a contact on the way it tries once more.

        Raises:
            HalError: Something still holds it, or it was lost.
        """
        try:
            go_home(self._cell)
        except MotionAborted as error:
            self._recover(error)
            go_home(self._cell)

    def _recover(self, error: MotionAborted) -> None:
        if isinstance(error, Stopped):
            raise error
        self._operator.recover(self._cell, str(error))

    def look(self, slots: list[Slot]) -> np.ndarray:
        """A picture (h, w, 3) of the pallet as it is now, the arm at home."""
        return pallet_image(self._cell.camera.capture(), slots, self._cell.workspace.table_z, self._tops)

    def _plan(self, frame: RgbdFrame, seed: int) -> GraspPlan:
        """The plan; where the last picture was the same, as under another correction, the last plan."""
        if (
            self._last is None
            or self._last[0] != seed
            or not np.array_equal(self._last[1], frame.depth, equal_nan=True)
        ):
            self._last = seed, frame.depth, self._planner.plan(frame, np.random.default_rng(seed))
        return self._last[2]

    def _agreed(self, frame: RgbdFrame, plan: GraspPlan, task: Task) -> bool:
        picture = self._pictures.parent / "next.png"
        if self._operator.asks:
            draw_plan(frame, plan, picture)
        where = f"x {task.slot.x:.3f}, y {task.slot.y:.3f} m"
        return self._operator.may_move(picture, f"{plan.summary}; then to {where}")

    def _carry(
        self, frame: RgbdFrame, plan: GraspPlan, targets: Sequence[Target], known: Placement
    ) -> tuple[Placement, Target, RgbdFrame | None]:
        """Grasps, places at the first target that the arm reaches, and measures.

        Returns:
            What came of it, the target, and the frame afterwards; None where nothing was placed.
        """
        cell, tracker, target = self._cell, self._cell.tracker, targets[0]
        before = None if tracker is None else tracker.part_pose()
        try:
            # Before anything moves, and not only when the part hangs in the hand.
            first_reachable(cell, [self._pose(plan, np.zeros(4), target) for target in targets])
            result = execute_grasp(cell, plan.grasp)
        except OutOfWorkspace:
            return replace(known, reason="OutOfWorkspace"), target, None
        if result.aborted is not None:
            self._operator.recover(cell, result.aborted)
            return replace(known, reason="collided"), target, None
        if not result.holding:
            return replace(known, reason="slipped" if result.lifted else "missed"), target, None
        measured = None
        if tracker is not None and before is not None:
            measured = _displacement(plan, before, result.T_base_tcp, tracker.part_pose())
            known = replace(known, measured=measured.tolist())
        by = {"none": np.zeros(4), "predicted": plan.displacement, "truth": measured}[known.correction]
        assert by is not None  # truth is refused where nothing tracks the part
        for target in targets:
            try:
                place(cell, self._pose(plan, by, target), self._recover)
            except OutOfWorkspace:
                continue  # the other way round, perhaps
            except MotionAborted as error:
                self._recover(error)
                return replace(known, reason="collided"), target, None
            self.home()
            after = cell.camera.capture()
            done = self._measured(frame, after, plan, before, target, replace(known, placed=True))
            return done, target, after
        self._put_back(plan)
        return replace(known, reason="OutOfWorkspace"), target, None

    def _pose(self, plan: GraspPlan, displacement: np.ndarray, target: Target) -> np.ndarray:
        table_z = self._cell.workspace.table_z
        return place_pose(plan.grasp, displacement, plan.view.centre_base, target, table_z)

    def _put_back(self, plan: GraspPlan) -> None:
        try:
            put_down(self._cell, plan.grasp)
        except MotionAborted as error:
            self._recover(error)

    def _measured(
        self,
        frame: RgbdFrame,
        after: RgbdFrame,
        plan: GraspPlan,
        before: Pose | None,
        target: Target,
        done: Placement,
    ) -> Placement:
        centre = plan.view.centre_base
        if self._tape is not None:
            try:
                moved, turn = self._tape_motion(frame, after, centre, target)
            except MarkersNotFound as error:
                return replace(done, unmeasured=str(error))
            missed, turned = (
                float(np.hypot(*(centre[:2] + moved - [target.x, target.y]))),
                turned_by(turn, target),
            )
        elif before is not None and self._cell.tracker is not None:
            offset = centre[:2] - before.position[:2]
            missed, turned = place_error(before, self._cell.tracker.part_pose(), offset, target)
        else:
            return replace(done, unmeasured="nothing tracks the part, and it carries no tape (--tape)")
        return replace(done, translation_error=missed, rotation_error=turned)

    def _tape_motion(
        self, frame: RgbdFrame, after: RgbdFrame, centre: np.ndarray, target: Target
    ) -> tuple[np.ndarray, float]:
        """How the part's centre moved along base x and y, and how it turned, by its tape.

        Raises:
            MarkersNotFound: Both squares are not seen, before or after.
        """
        workspace = self._cell.workspace
        first = find_markers(frame, self._tape, table_z=workspace.table_z, region=workspace.region)
        around: Region = (target.x - _NEAR, target.x + _NEAR, target.y - _NEAR, target.y + _NEAR)
        second = find_markers(after, self._tape, table_z=workspace.table_z, region=around)
        # With no turn the grasp frame has the base's axes.
        dx, dy, turn = planar_displacement(first, second, np.zeros(4), centre)
        return np.array([dx, dy]), float(turn)


def _displacement(plan: GraspPlan, before: Pose, T_base_tcp: Pose, lifted: Pose) -> np.ndarray:  # noqa: N803
    """(4,) of the part's seen centre in the hand, from the tracker."""
    found, _ = object_displacement(
        pose_base_tcp(plan.grasp).inverse() @ before, T_base_tcp.inverse() @ lifted
    )
    origin, centre = (
        centre_in_grasp_frame(point, plan.grasp) for point in (before.position, plan.view.centre_base)
    )
    return displacement_of_point(np.asarray(found), origin, centre)
