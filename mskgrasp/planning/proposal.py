"""Planners of other packages and programs: the grasp that they propose, and the plan made of it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from hal.backends import find_backend, package_of
from hal.camera import RgbdFrame
from hal.cell import Workspace
from mskgrasp.core.displacement_covariance import (
    grasp_displacement_covariance,
    half_turned_covariance,
    half_turned_displacement,
)
from mskgrasp.core.errors import BadPlanner, MskgraspError, first_line
from mskgrasp.core.geometry import wrap_half_turn
from mskgrasp.core.grasp import Grasp, PartView, centre_in_grasp_frame, to_grasp_displacement
from mskgrasp.perception.part_detection import view_part
from mskgrasp.planning.grasp_plan import GraspPlan

GROUP = "planners"
"""Group of entry points, after ``mskgrasp.``."""


@dataclass(frozen=True, kw_only=True)
class ProposedGrasp:
    """A grasp, and whatever its planner predicts of it.

    Attributes:
        grasp: Base frame; theta need not be within half a turn.
        quality: Predicted probability of success; None: not predicted.
        displacement: (4,) expected displacement of the point in the hand, axes of the grasp frame, metres and
            radians; None: zero.
        displacement_cov: (4, 4) its covariance; None: not predicted.
        point_base: (3,) the point of the part before the grasp, base frame, metres; None: the middle of its
            box in the image, as `mskgrasp.perception.part_detection.view_part` finds it.
    """

    grasp: Grasp
    quality: float | None = None
    displacement: np.ndarray | None = None
    displacement_cov: np.ndarray | None = None
    point_base: np.ndarray | None = None


class ProposesGrasps(Protocol):
    """Interface of planners of other packages."""

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> ProposedGrasp | GraspPlan:
        """Plan a grasp of the part in a frame.

        Raises:
            NoGraspFound: No grasp is worth trying.
        """
        ...


class OtherPlanner:
    """Planner that makes plans of another planner's grasps.

    Args:
        planner: The other planner.
        workspace: Table and region, in which the part is detected.
        name: Of the planner, for messages.
    """

    def __init__(self, planner: ProposesGrasps, workspace: Workspace, name: str):
        self._planner = planner
        self._workspace = workspace
        self._name = name

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> GraspPlan:
        """Plan a grasp of the part in a frame.

        Raises:
            NoPartFound: No part is detected.
            NoGraspFound: The other planner finds none.
            BadPlanner: It fails, or answers with something that is not a grasp.
        """
        started = time.perf_counter()
        view = view_of(frame, self._workspace)
        try:
            answer = self._planner.plan(frame, rng)
        except MskgraspError:
            raise
        except Exception as error:
            raise BadPlanner(f"planner {self._name!r} fails: {first_line(error)}; repair it") from error
        if isinstance(answer, GraspPlan):
            return answer
        try:
            return plan_of(answer, view, time.perf_counter() - started)
        except (ValueError, TypeError, AttributeError, IndexError) as error:
            raise BadPlanner(f"planner {self._name!r} answers no grasp: {first_line(error)}") from error


def view_of(frame: RgbdFrame, workspace: Workspace) -> PartView:
    """Detect the part of a frame in a workspace.

    Raises:
        NoPartFound: No part is detected.
    """
    return view_part(
        frame.depth, frame.intrinsics, frame.T_base_camera, table_z=workspace.table_z,
        region=workspace.region, min_height=workspace.min_height, alone=True,
    )  # fmt: skip


def plan_of(proposed: ProposedGrasp, view: PartView, seconds: float) -> GraspPlan:
    """Make the plan of a proposed grasp; unknown predictions are NaN, and an unknown displacement is zero.

    Args:
        proposed: The grasp.
        view: The part as detected.
        seconds: Time taken.

    Raises:
        ValueError: A value has another shape, is not finite, or no probability or covariance.
    """
    given = _checked("grasp", proposed.grasp.as_vector(), (4,))
    grasp = given.copy()
    grasp[3] = wrap_half_turn(given[3])
    # The axes of a grasp that is turned by half a turn are reversed.
    sign = 1.0 if np.cos(grasp[3] - given[3]) > 0 else -1.0
    quality = np.nan if proposed.quality is None else float(proposed.quality)
    if proposed.quality is not None and not 0 <= quality <= 1:
        raise ValueError(f"quality is {quality:g}, legal: 0 .. 1")
    point_base = view.centre_base if proposed.point_base is None else proposed.point_base
    point = centre_in_grasp_frame(_checked("point_base", point_base, (3,)), grasp)
    motion = np.zeros(4)
    if proposed.displacement is not None:
        moved = half_turned_displacement(_checked("displacement", proposed.displacement, (4,)), sign)
        motion = np.asarray(to_grasp_displacement(moved, point))
    covariance, score = np.full((4, 4), np.nan), np.nan
    if proposed.displacement_cov is not None:
        given_cov = _checked("displacement_cov", proposed.displacement_cov, (4, 4))
        rounding = 1e-6 * np.abs(given_cov).max()
        least = np.linalg.eigvalsh(given_cov).min()
        if np.abs(given_cov - given_cov.T).max() > rounding or least < -rounding:
            raise ValueError("displacement_cov is no covariance: it must be symmetric and positive")
        of_point = half_turned_covariance(given_cov, sign)
        covariance = grasp_displacement_covariance(motion, of_point, point)
        score = float(np.trace(of_point[:3, :3]) + view.gyration_radius**2 * of_point[3, 3])
    return GraspPlan(
        grasp=Grasp.from_vector(grasp),
        quality=quality,
        grasp_displacement=motion,
        grasp_displacement_cov=covariance,
        swing=np.full(2, np.nan),
        swing_var=np.full(2, np.nan),
        score=score,
        view=view,
        candidates=Grasp.from_vector(grasp[None]),
        qualities=np.array([quality]),
        shortlist=np.array([0]),
        shortlist_scores=np.array([score]),
        seconds={"total": seconds},
        planned_by="another planner",
    )


def installed_planner(name: str, built_in: tuple[str, ...], workspace: Workspace, key: str) -> OtherPlanner:
    """Build the planner of an installed package, named by an entry point of the group ``mskgrasp.planners``.

    The entry point is a function of a `hal.Workspace` that returns an object with ``plan``.

    Args:
        name: Of the entry point.
        built_in: Names of the planners of this program.
        workspace: Table and region.
        key: Option that holds the name, for messages.

    Raises:
        BadConfig: Nothing has that name; the message lists all.
        BadBackend: Several have that name.
        BadPlanner: The package fails, or offers something else.
    """
    entry = find_backend(name, GROUP, built_in, key)
    assert entry is not None, "a planner of this program"
    named = f"planner {name!r} of package {package_of(name, GROUP)} ({entry.value})"
    try:
        make: Callable[[Workspace], Any] = entry.load()
        planner = make(workspace)
    except (Exception, SystemExit) as error:
        raise BadPlanner(f"{named} cannot be made: {first_line(error)}; repair or uninstall it") from error
    if not callable(getattr(planner, "plan", None)):
        raise BadPlanner(f"{named} must be a function that returns an object with plan(frame, rng)")
    return OtherPlanner(planner, workspace, name)


def _checked(name: str, values: Any, shape: tuple[int, ...]) -> np.ndarray:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite and of shape {shape}, got {array.tolist()}")
    return array
