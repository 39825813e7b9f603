"""Planner for a known part: its simulated grasp of least expected error, or else the networks' grasp."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from hal.camera import RgbdFrame
from hal.cell import Cell
from hal.errors import OutOfWorkspace
from mskgrasp.core.displacement_covariance import (
    grasp_displacement_covariance,
    half_turned_covariance,
    half_turned_displacement,
)
from mskgrasp.core.errors import BadPart, PartNotRecognised
from mskgrasp.core.geometry import twist_and_swing
from mskgrasp.core.grasp import Grasp, centre_in_grasp_frame, to_grasp_displacement
from mskgrasp.parts import Part
from mskgrasp.parts.alike_poses import PartSurface
from mskgrasp.perception.part_pose import KnownPart, PartPose, find_part_pose
from mskgrasp.planning.certified import (
    SIMULATED_ALIKE,
    CertifiedGrasps,
    half_turned,
    radius_about_vertical,
    read_certified,
    rest_frame,
    to_base,
    turned,
)
from mskgrasp.planning.grasp_plan import GraspPlan, PlannedBy
from mskgrasp.planning.planner import Planner
from mskgrasp.runtime.progress import note

AMBIGUOUS_FROM = 1.5e-3
"""Expected distance (RMS) of the part's surface from where the best pose has it, metres: beyond it the
networks, which err by some millimetres, are the better choice."""
MOST_RAISED = 4e-4
"""Greatest height by which a grasp may be raised to keep the cell's clearance, metres: two standard
deviations of the heights at which it was simulated. Higher, the hand would hold the part elsewhere."""


class CertifiedPlanner:
    """Planner of certified grasps of one part.

    An image of a noisy camera may fit two poses, such as those of an open box that lies on its side with the
    opening to the left or to the right. A certified grasp is that of one pose, so the networks, which see no
    more than the image, plan there.

    Args:
        planner: Plans where the part has no simulated grasp that the arm reaches, and knows the table.
        part: The part on the table.
        certified: Its certified grasps.
        reachable: Whether the arm can execute a grasp; None: all.
    """

    def __init__(
        self,
        planner: Planner,
        part: Part,
        certified: CertifiedGrasps,
        reachable: Callable[[Grasp], bool] | None = None,
    ):
        self._known = KnownPart.of(part, certified.stands)
        self._planner = planner.for_part(self._known.least_top)
        self._part = part
        self._certified = certified
        self._surface = PartSurface.of(part)
        self._reachable = reachable or (lambda grasp: True)

    def with_grasps(self, certified: CertifiedGrasps) -> CertifiedPlanner:
        """The same planner with other certified grasps of the part, such as none."""
        other = copy.copy(self)
        other._certified = certified
        return other

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> GraspPlan:
        """Plan a grasp of the part in a frame.

        Raises:
            NoPartFound: No part is detected.
            PartNotRecognised: What lies there is not this part, or does not lie flat.
            TableTooHigh: The table is seen too high, as by `Planner.view`.
            GraspRefused: No simulated grasp is within reach, and no candidate has the required quality.
        """
        started = time.perf_counter()
        planner = self._planner
        found = self._find(frame)
        located = time.perf_counter()
        plan, reason = None, "the image fits two poses of it"
        if not self._ambiguous(found):
            plan, reason = self._simulated_plan(frame, found)
        if reason:
            self._tell(found, plan, reason)
        if plan is None:
            plan = replace(planner.plan(frame, rng), pose=found)
        now = time.perf_counter()
        known = plan.seconds or {"select": now - located}
        return replace(plan, seconds=known | {"pose": located - started, "total": now - started})

    def _find(self, frame: RgbdFrame) -> PartPose:
        """The part's pose: one that stands in the simulation or, if none fits, any resting pose.

        On a real table a pose may stand that topples in the simulation. It has no certified grasp.
        """
        space = self._planner
        found = partial(
            find_part_pose, frame, table_z=space.table_z, region=space.region, min_height=space.min_height
        )
        try:
            return found(self._known)
        except PartNotRecognised:
            if all(self._certified.stands):
                raise
            return found(self._in_any_pose)

    @cached_property
    def _in_any_pose(self) -> KnownPart:
        return KnownPart.of(self._part)

    def _ambiguous(self, found: PartPose) -> bool:
        """Whether the image fits poses that may need different grasps, and that are likely enough."""
        squared = sum(
            other.share * self._surface.apart(found.T_base_obj, other.T_base_obj) ** 2
            for other in found.alternatives
        )
        return squared > AMBIGUOUS_FROM**2

    def _tell(self, found: PartPose, plan: GraspPlan | None, reason: str) -> None:
        """Report why no certified grasp is planned, unless the networks' was asked for."""
        if not (self._certified.grasps or self._certified.uncertified or self._certified.without):
            return
        by = "by the networks" if plan is None else "with the best that was simulated"
        which = f"'{self._part.name}' in resting pose {found.resting}"
        note(f"{which} gets no certified grasp: {reason}; planned {by}")

    def _simulated_plan(self, frame: RgbdFrame, found: PartPose) -> tuple[GraspPlan | None, str]:
        """The plan of the best simulated grasp that the cell can execute, certified ones first.

        Returns:
            The plan, None if there is none; and why it is not a certified one, empty if it is.
        """
        planner, part = self._planner, self._part
        planned_by: PlannedBy = "certified"
        grasps, turn = self._certified.of(found.resting)
        reason = ""
        if not grasps:
            planned_by = "uncertified"
            grasps, turn = self._certified.uncertified_of(found.resting)
            group = self._certified.like.get(found.resting, (found.resting, 0.0))[0]
            reason = self._certified.without.get(group, "it has none")
        if not grasps:
            return None, reason
        view = planner.view(frame)
        T_base_rest = turned(rest_frame(found.T_base_obj, part.resting.quat_wxyz[found.resting]), turn)
        # Over the stated height of the table, which a hand can touch: a camera's depth may be off by more.
        vectors = to_base(T_base_rest, np.stack([one.grasp for one in grasps]), planner.table_z)
        vectors[:, 2] += planner.rise(vectors[:, :2])
        cleared = planner.cleared(vectors)
        high_enough = cleared[:, 2] - vectors[:, 2] <= MOST_RAISED
        vectors = cleared
        radius = radius_about_vertical(part, found.resting)
        facing = float(twist_and_swing(T_base_rest.quat_wxyz)[0])
        alike = np.diag(SIMULATED_ALIKE)
        scores = (
            alike[:3].sum()
            + radius**2 * alike[3]
            + np.array(
                [
                    one.score(_turned_covariance(found.covariance, facing + one.grasp[3]), radius)
                    for one in grasps
                ]
            )
        )
        order = np.argsort(scores, kind="stable")
        fit = (row for row in order if high_enough[row] and self._reachable(Grasp.from_vector(vectors[row])))
        row = next(fit, None)
        if row is None:
            which = "these" if reason else "its certified grasps"
            none = f"the arm reaches none of {which}"
            if not high_enough.all():
                least = np.ceil(1e4 * planner.clearance - 1e-6) / 1e4
                none = (
                    f"the arm reaches none of {which} that keeps the cell's clearance from the table; assess "
                    f"the part with --clearance {least:g}"
                )
            return None, f"{reason}, and {none}" if reason else none
        chosen = grasps[row]
        sign = half_turned(T_base_rest, chosen.grasp, vectors[row])
        covariance = chosen.covariance(_turned_covariance(found.covariance, facing + chosen.grasp[3]))
        mean = half_turned_displacement(chosen.mean, sign)
        covariance = half_turned_covariance(covariance, sign) + SIMULATED_ALIKE
        origin = centre_in_grasp_frame(np.asarray(found.T_base_obj.position), vectors[row])
        motion = to_grasp_displacement(mean, origin)
        plan = GraspPlan(
            grasp=Grasp.from_vector(vectors[row]),
            quality=chosen.expected_share,
            grasp_displacement=motion,
            grasp_displacement_cov=grasp_displacement_covariance(motion, covariance, origin),
            swing=sign * chosen.swing,
            swing_var=np.diag(chosen.swing_cov).copy(),
            score=float(scores[row]),
            view=view,
            candidates=Grasp.from_vector(vectors),
            qualities=np.array([one.expected_share for one in grasps]),
            shortlist=order,
            shortlist_scores=scores[order],
            seconds={},
            pose=found,
            planned_by=planned_by,
        )
        return plan, reason


def planner_of_part(
    planner: Planner, cell: Cell, part: Part, folder: Path | None = None
) -> Planner | CertifiedPlanner:
    """The planner for a part: with policy ``certified`` that of its certified grasps, if it has any.

    They are read from the cache unless another folder is given. A part without certified grasps is named on
    standard error, with the remedy.
    """
    if planner.config.policy != "certified":
        return planner
    try:
        certified = read_certified(part, folder)
    except BadPart as error:
        note(f"planned by the networks: {error}")
        return planner

    return CertifiedPlanner(planner, part, certified, reachable_by(cell))


def reachable_by(cell: Cell) -> Callable[[Grasp], bool]:
    """Whether a cell's arm reaches a grasp and the end of its lift."""

    def reachable(grasp: Grasp) -> bool:
        try:
            for height in (0.0, cell.workspace.lift_height):
                cell.arm.check_pose(grasp.raised(height).T_base_tcp)
        except OutOfWorkspace:
            return False
        return True

    return reachable


def _turned_covariance(covariance: np.ndarray, angle: float) -> np.ndarray:
    """Covariance (3, 3) of x, y and turn in axes turned by an angle against those it is given in."""
    cos, sin = np.cos(angle), np.sin(angle)
    into = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return into @ covariance @ into.T
