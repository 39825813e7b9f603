"""Pick and place of one part on any cell, and measurement of the placement error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hal import RgbdFrame, capture_at_home
from hal.errors import MotionAborted, OutOfWorkspace
from mskgrasp.core.errors import MarkersNotFound, NoPartFound
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import Grasp
from mskgrasp.core.settings import Region
from mskgrasp.palletize.figures import draw_placement, pallet_image
from mskgrasp.palletize.height_maps import read_height_maps, take_height_maps, write_height_maps
from mskgrasp.palletize.pallet_slots import SEEN_TOLERANCE, Slot, first_reachable
from mskgrasp.palletize.placement_records import Correction, Placement, placement_name
from mskgrasp.parts import Part, find_part
from mskgrasp.perception.footprint import seen_footprint
from mskgrasp.perception.markers import planar_displacement
from mskgrasp.planning.certified_planner import planner_of_part
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.planning.place_pose import (
    Target,
    drop_of,
    place,
    place_error,
    place_pose,
    taken_along,
    turned_by,
)
from mskgrasp.planning.planner import Planner
from mskgrasp.planning.release import release_opening
from mskgrasp.planning.run_inputs import kept_certified
from mskgrasp.trials.engine import TrialEngine
from mskgrasp.trials.policies import RepeatedPlanner
from mskgrasp.trials.trial import reason_of

_NEAR = 0.001
"""Half the side of the region searched for a placed part's tape, m; `find_markers` adds its margin."""


@dataclass(frozen=True, kw_only=True)
class PlacementTask:
    """Task of placing a part into a slot.

    Attributes:
        part: Name or folder of the part.
        number: Index of the trial of the part, or of the pallet.
        index: Index of the slot.
        slot: The slot.
        correction: Displacement that is corrected for.
        seed: Seed of the scene: determines the part's pose and the candidates.
        keep: Parts on the pallet stay.
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


class PickAndPlace:
    """Pick and place of parts into slots.

    Args:
        engine: Engine of a connected cell.
        planner: Planner for that cell.
        out: Folder of the run: gets the picture and the height maps of every placement, keeps the certified
            grasps.
    """

    def __init__(self, engine: TrialEngine, planner: Planner, out: Path):
        self._engine = engine
        self._cell = engine.cell
        self._planner = planner
        self._planners: dict[str, RepeatedPlanner] = {}
        self._pictures = out / "placements"
        self._out = out
        self._tops: dict[int, float] = {}

    def run(self, task: PlacementTask, name: str = "") -> Placement:
        """Place one part into its slot, measure it and write its picture.

        Args:
            task: The part and its slot.
            name: Title for the operator, such as "placement 3 of 20".

        Raises:
            HalError: The cell was lost; this placement is not stored.
            StoppedByOperator: The operator ended the run.
        """
        if not task.keep:
            self._tops = {}
        if self._cell.feeder is None:  # `skip` must not read maps of a placement that was never stored
            (self._pictures / f"{placement_name(task.key)}.npz").unlink(missing_ok=True)
        slot = task.slot
        failed = Placement(
            part=find_part(task.part).name, number=task.number, slot=task.index, correction=task.correction,
            target=(slot.x, slot.y, slot.theta), placed=False, reason="",
        )  # fmt: skip
        planned = self._engine.present(
            task.part, task.seed, self._planner_of(task.part), name=name, keep=task.keep,
            then=f"then to x {slot.x:.3f}, y {slot.y:.3f} m",
        )  # fmt: skip
        frame, plan = planned.frame, planned.plan
        if plan is None:
            return replace(failed, reason=planned.reason, refusal=planned.refusal)
        known = replace(failed, grasp=plan.grasp.as_vector().tolist(), predicted=plan.displacement.tolist())
        workspace = self._cell.workspace
        try:
            footprint = seen_footprint(
                frame, table_z=workspace.table_z, region=workspace.region, min_height=workspace.min_height,
                part_height=float(plan.view.size[2]),  # a known part may have been found by it
            )  # fmt: skip
        except NoPartFound:
            return replace(known, reason=reason_of(NoPartFound))
        if not slot.fits(footprint, SEEN_TOLERANCE):
            return replace(known, reason="slot too small")
        done, target, after = self._carry(frame, plan, planned.part, slot.targets(footprint), known)
        if done.placed:
            self._tops[task.index] = float(plan.view.size[2])
        maps = take_height_maps(frame, after, plan, target, slot.theta)
        write_height_maps(maps, self._pictures / f"{done.name}.npz")
        draw_placement(maps, done, self._pictures / f"{done.name}.png")
        return done

    def skip(self, task: PlacementTask) -> None:
        """Take note of a placement that an earlier run made, whose part still lies in its slot.

        Raises:
            BadDataset: Its height maps are damaged.
        """
        if not task.keep:
            self._tops = {}
        path = self._pictures / f"{placement_name(task.key)}.npz"
        # Without a grasp there are no maps; where no part was placed, `after` is empty.
        if path.exists() and (maps := read_height_maps(path)).after.size:
            self._tops[task.index] = maps.top

    def _planner_of(self, part: str) -> RepeatedPlanner:
        if part not in self._planners:
            found = find_part(part)
            kept = kept_certified(self._out, found)
            own = planner_of_part(self._planner, self._cell, found, kept)
            self._planners = {part: RepeatedPlanner(own)}
        return self._planners[part]

    def picture(self, slots: list[Slot]) -> np.ndarray:
        """Capture an image (h, w, 3) of the pallet, the arm at home."""
        return pallet_image(capture_at_home(self._cell), slots, self._cell.workspace.table_z, self._tops)

    def _carry(
        self,
        frame: RgbdFrame,
        plan: GraspPlan,
        part: Part | None,
        targets: Sequence[Target],
        known: Placement,
    ) -> tuple[Placement, Target, RgbdFrame | None]:
        """Grasp, place at the first target that the arm reaches, and measure.

        Returns:
            The outcome, the target, and the frame after placing; None where nothing was placed.
        """
        engine, target = self._engine, targets[0]
        # Filled slots may be out of the image.
        tallest = max([engine.tallest(frame, plan.view), *self._tops.values()])
        try:
            # Refused before the grasp, rather than with the part in the hand.
            poses = [self._pose(plan, np.zeros(4), target) for target in targets]
            first_reachable(self._cell, poses, tallest=tallest)
        except OutOfWorkspace:
            return replace(known, reason=reason_of(OutOfWorkspace)), target, None
        grasped = engine.grasp(plan, part)
        if grasped.aborted:
            engine.recover(MotionAborted(grasped.aborted))
        if grasped.reason:
            return replace(known, reason=grasped.reason), target, None
        measured = grasped.displacement_of_centre(plan)
        if measured is not None:
            known = replace(known, measured=measured.tolist())
        by, swing = {
            "none": (np.zeros(4), None),
            "predicted": (plan.displacement, plan.swing),
            "truth": (measured, grasped.swing),
        }[known.correction]
        assert by is not None  # truth is refused without a tracker
        drop = 0.0 if swing is None else drop_of(plan.grasp, plan.view, by[3], swing)
        assert grasped.result is not None  # it succeeded
        opening = release_opening(frame, plan, grasped.result.width)
        released: list[bool] = []
        for target in targets:
            try:
                place(
                    self._cell, self._pose(plan, by, target, drop), engine.recover,
                    drop=drop, opening=opening, tallest=tallest, part_height=float(plan.view.size[2]),
                    arrived=lambda: released.append(True),
                )  # fmt: skip
            except OutOfWorkspace:
                if released:  # the hand could not rise: nothing is held any more
                    raise
                continue  # the other target may be reached
            except MotionAborted as error:
                engine.recover(error)
                if released:  # it stands in the slot
                    self._tops[known.slot] = float(plan.view.size[2])
                return replace(known, reason="collided"), target, None
            lies = engine.part_pose()
            if not engine.leave():
                return replace(known, reason="not released"), target, None
            if lies is not None and grasped.before is not None and taken_along(grasped.before, lies):
                return replace(known, reason="not released"), target, None
            after = engine.capture()
            done = self._measured(frame, after, plan, grasped.before, target, replace(known, placed=True))
            return done, target, after
        engine.put_back(plan)
        return replace(known, reason=reason_of(OutOfWorkspace)), target, None

    def _pose(self, plan: GraspPlan, displacement: np.ndarray, target: Target, drop: float = 0.0) -> Grasp:
        lowest, centre = self._cell.workspace.lowest_grasp_z, plan.view.centre_base
        return place_pose(plan.grasp, displacement, centre, target, lowest, drop=drop)

    def _measured(
        self,
        frame: RgbdFrame,
        after: RgbdFrame,
        plan: GraspPlan,
        before: Pose | None,
        target: Target,
        done: Placement,
    ) -> Placement:
        """Add the errors to a placement, measured by tape if the engine has it, else by the tracker."""
        centre, pose = plan.view.centre_base, self._engine.part_pose()
        if self._engine.tape is not None:
            try:
                moved, turn = self._tape_motion(frame, after, centre, target)
            except MarkersNotFound as error:
                return replace(done, unmeasured=str(error))
            distance = float(np.hypot(*(centre[:2] + moved - [target.x, target.y])))
            angle = turned_by(turn, target)
        elif before is not None and pose is not None:
            distance, angle = place_error(before, pose, centre[:2] - before.position[:2], target)
        else:
            return replace(done, unmeasured="no tracker and no tape (--tape)")
        return replace(done, translation_error=distance, rotation_error=angle)

    def _tape_motion(
        self, frame: RgbdFrame, after: RgbdFrame, centre: np.ndarray, target: Target
    ) -> tuple[np.ndarray, float]:
        """Measure the motion of the part's centre along base x and y, and its turn, by its tape.

        Raises:
            MarkersNotFound: A square is not detected before or after.
        """
        first = self._engine.find_tape(frame)
        around: Region = (target.x - _NEAR, target.x + _NEAR, target.y - _NEAR, target.y + _NEAR)
        second = self._engine.find_tape(after, around)
        # A grasp frame with theta 0 has the base's axes.
        dx, dy, turn = planar_displacement(first, second, Grasp.from_vector(np.zeros(4)), centre)
        return np.array([dx, dy]), float(turn)
