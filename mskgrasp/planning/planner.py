"""Planner of grasps with high quality and low displacement variance (paper, section 3.4).

`Planner` and `GraspPlan` speak of grasps as `Grasp`; the search itself, like `mskgrasp.planning.scoring` and
`mskgrasp.planning.refine`, works on arrays (n, 4), x y z theta in the base frame.
"""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from hal.camera import RgbdFrame
from hal.cell import Workspace
from hal.table import HIGHEST_TABLE
from mskgrasp.core.displacement_covariance import (
    object_displacement_covariance,
    swing_squared,
)
from mskgrasp.core.errors import BadModel, GraspRefused, NoGraspFound, TableTooHigh
from mskgrasp.core.grasp import (
    PAD_REACH,
    Grasp,
    PartView,
    centre_in_grasp_frame,
    lowest_grasp_z,
    sample_grasps,
)
from mskgrasp.learning.grasp_models import Models
from mskgrasp.perception.part_detection import view_part
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.grasp_plan import GraspPlan, Shortlist
from mskgrasp.planning.refine import hand_room, where_held
from mskgrasp.planning.refusal import refusal_reason
from mskgrasp.planning.scoring import Scene, displacements, qualities

PROMISING = 12
"""Number of candidates, best by the score of one view, whose displacement is predicted from every view."""

RECENTRED = 48
"""Number of candidates of the shortlist, best by the score of one view, that are tried recentred, too.

What the search loses by both, and by smaller numbers: `tests.benchmarks.search_breadth`.
"""
Predict = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""Function that predicts mean and variance (n, k) and the variance score (n,) of grasps (n, 4)."""


class Planner:
    """Planner that samples grasps over the part, scores them with the networks, and selects one."""

    def __init__(
        self,
        models: Models,
        config: PlannerConfig,
        *,
        table_z: float,
        region: tuple[float, float, float, float],
        min_height: float = 0.002,
        lowest_grasp_z: Callable[[np.ndarray], np.ndarray] | None = None,
    ):
        """Take the workspace: table height, region (x_min, x_max, y_min, y_max), least height of a part.

        All in metres, base frame. ``lowest_grasp_z`` gives the least z (n,) of grasps at points (n, 2), as
        `hal.Workspace.lowest_grasp_z` does; by default `TABLE_CLEARANCE` over a level table.

        Raises:
            BadModel: The policy needs variances and the model predicts none.
        """
        if config.policy != "quality" and not models.meta.network.variance:
            raise BadModel(
                "this model predicts no variance; use policy: quality, or train with variance: true"
            )
        self.models = models
        self.config = config
        self.table_z = table_z
        self.region = region
        self.min_height = min_height
        self._part_height = math.inf
        self._lowest_grasp_z = lowest_grasp_z

    @classmethod
    def of_workspace(cls, models: Models, config: PlannerConfig, workspace: Workspace) -> Planner:
        """Make the planner for a cell's table.

        Raises:
            BadModel: The policy needs variances and the model predicts none.
        """
        return cls(
            models,
            config,
            table_z=workspace.table_z,
            region=workspace.region,
            min_height=workspace.min_height,
            lowest_grasp_z=workspace.lowest_grasp_z,
        )

    def for_part(self, height: float) -> Planner:
        """The same planner for a known part of a height as it lies flattest, metres."""
        other = copy.copy(self)
        other._part_height = height
        return other

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> GraspPlan:
        """Plan a grasp of the part in a frame.

        Raises:
            NoPartFound: No part is detected.
            GraspRefused: No candidate has the required quality; the message says why.
            NoGraspFound: With ``check_fingers``, the fingers of every candidate would collide.
            TableTooHigh: The table is seen more than `hal.table.HIGHEST_TABLE` over its stated height.
        """
        started = time.perf_counter()
        view, drawn = self.sample(frame, rng)
        candidates = drawn.as_vector()
        scene = Scene.of(frame, view, self.table_z, self.models.device)
        sampled = time.perf_counter()
        found = qualities(self.models, scene, candidates, self.config.chunk_size)
        scored = time.perf_counter()
        rows, scores = self._shortlist(scene, candidates, found), None
        if self.config.recentre and self.config.policy != "quality":
            rough = partial(self._predicted, scene, all_views=False)
            candidates, found, seen = self.recentred(scene, candidates, found, rows, rough)
            rows, scores = seen.rows, seen.scores
        best = self._scored(scene, candidates, found, rows, scores)
        self.refuse_poor(frame, view, candidates, found[best.rows])
        chosen = select(found[best.rows], best.scores, self.config)
        selected = time.perf_counter()
        seconds = {
            "sample": sampled - started,
            "score": scored - sampled,
            "select": selected - scored,
            "total": selected - started,
        }
        return GraspPlan.of(view, Grasp.from_vector(candidates), found, best, chosen, seconds=seconds)

    def refuse_poor(
        self, frame: RgbdFrame, view: PartView, candidates: np.ndarray, qualities: np.ndarray
    ) -> None:
        """Refuse a part none of whose grasps is worth trying.

        Args:
            frame: Frame of the part.
            view: The part as detected in it.
            candidates: (n, 4) grasps, base frame.
            qualities: (k,) predicted qualities of the best of them.

        Raises:
            GraspRefused: All are lower than ``min_quality``; the message says why.
        """
        best = float(qualities.max())
        if best < self.config.least_quality:
            scene = Scene.of(frame, view, self.table_z, self.models.device)
            reason = refusal_reason(
                frame,
                scene,
                candidates,
                self.config.least_quality,
                region=self.region,
                min_height=self.min_height,
                part_height=self._part_height,
            )
            raise GraspRefused(f"no grasp found (best quality {best:.2f}): {reason}", best)

    def _shortlist(self, scene: Scene, candidates: np.ndarray, found: np.ndarray) -> np.ndarray:
        """Find the best candidates; with ``check_fingers`` the best whose fingers are free.

        Raises:
            NoGraspFound: The fingers of every candidate would collide.
        """
        if not self.config.check_fingers:
            return shortlist(found, self.config.top_fraction)
        n = len(shortlist(found, self.config.top_fraction))
        order, free = shortlist(found, 1.0), np.zeros(0, dtype=np.int64)
        for rows in np.array_split(order, max(1, len(order) // (4 * n))):
            free = np.append(free, rows[hand_room(scene, candidates[rows])[0]])
            if len(free) >= n:
                break
        if not len(free):
            raise NoGraspFound(
                "something is in the way of the open fingers of every candidate; clear the table around the "
                "part, or switch check_fingers off"
            )
        return free[:n]

    def recentred(
        self, scene: Scene, candidates: np.ndarray, found: np.ndarray, rows: np.ndarray, predict: Predict
    ) -> tuple[np.ndarray, np.ndarray, Shortlist]:
        """Add grasps at the places where the part would come to lie between the pads: there it moves less.

        Args:
            scene: The height image.
            candidates: (n, 4) grasps.
            found: (n,) their qualities.
            rows: (k,) the shortlist.
            predict: Predicts mean, variance and variance score of grasps.

        Returns:
            Candidates, qualities, and the shortlist, best quality first, the added ones among them.
        """
        mean, variance, scores = predict(candidates[rows])
        best = by_score(found[rows], scores, self.config)[:RECENTRED]
        moved = self.cleared(where_held(candidates[rows[best]], mean[best]))
        if self.config.check_fingers:
            moved = moved[hand_room(scene, moved)[0]]
        quality = qualities(self.models, scene, moved, self.config.chunk_size)
        # As good as the shortlist, or sure; 0 calls none sure.
        good = quality >= min(self.config.sure_quality or 1.0, float(found[rows].min()))
        more = Shortlist(len(candidates) + np.arange(int(good.sum())), *predict(moved[good]))
        candidates = np.append(candidates, moved[good], axis=0)
        found = np.append(found, quality[good])
        return candidates, found, Shortlist(rows, mean, variance, scores).joined(more, found)

    def _scored(
        self,
        scene: Scene,
        candidates: np.ndarray,
        found: np.ndarray,
        rows: np.ndarray,
        scores: np.ndarray | None = None,
    ) -> Shortlist:
        """Predict the displacements of some candidates, best quality first.

        Where a prediction is the mean over several views of a grasp, only `PROMISING` candidates are kept:
        those of the least variance score by one view, or of the best quality if the policy asks for it.
        ``scores`` are those by one view, where they are known.
        """
        if self.models.meta.network.symmetric_views:
            good = np.flatnonzero(found[rows] >= self.config.least_quality)
            if len(good) > PROMISING and self.config.policy != "quality":
                if scores is None:
                    *_, scores = self._predicted(scene, candidates[rows], all_views=False)
                first = by_score(found[rows[good]], scores[good], self.config)[:PROMISING]
                rows = rows[np.sort(good[first])]
            rows = rows[:PROMISING]
        return Shortlist(rows, *self._predicted(scene, candidates[rows], all_views=True))

    def _predicted(
        self, scene: Scene, grasps: np.ndarray, *, all_views: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Predict mean, variance and variance score of grasps (n, 4)."""
        mean, variance = displacements(
            self.models, scene, grasps, self.config.chunk_size, all_views=all_views
        )
        return mean, variance, variance_score(mean, variance, grasps, scene.view)

    def sample(self, frame: RgbdFrame, rng: np.random.Generator) -> tuple[PartView, Grasp]:
        """Detect the part and sample ``n_candidates`` grasps over it.

        Raises:
            NoPartFound: No part is detected.
            TableTooHigh: The table is seen more than `hal.table.HIGHEST_TABLE` over its stated height.
        """
        view = self.view(frame)
        grasps = self.cleared(sample_grasps(view, self.config.n_candidates, rng))
        return view, Grasp.from_vector(grasps)

    def view(self, frame: RgbdFrame) -> PartView:
        """Detect the part in a frame.

        Raises:
            NoPartFound: No part is detected.
            TableTooHigh: The table is seen more than `hal.table.HIGHEST_TABLE` over its stated height.
        """
        view = view_part(
            frame.depth,
            frame.intrinsics,
            frame.T_base_camera,
            table_z=self.table_z,
            region=self.region,
            min_height=self.min_height,
            part_height=self._part_height,
            alone=True,
        )
        if view.table_offset > HIGHEST_TABLE:
            raise TableTooHigh(
                f"the table is seen {1e3 * view.table_offset:.1f} mm over table_z {self.table_z:g}, more "
                f"than {1e3 * HIGHEST_TABLE:g} mm: the fingers could press on it; run hal.touch, and if "
                "table_z holds, correct camera.depth_offset"
            )
        return view

    @property
    def clearance(self) -> float:
        """Least distance of the pads from the table, metres; on a slope, of their middle."""
        return float(self._lowest(self._middle)) - self.table_z - PAD_REACH

    def rise(self, xy: np.ndarray) -> np.ndarray:
        """Heights (n,) of a sloping table at points (n, 2) over its height in the region's middle, metres."""
        return self._lowest(xy) - self._lowest(self._middle)

    @property
    def _middle(self) -> np.ndarray:
        return np.reshape(self.region, (2, 2)).mean(axis=1)

    def _lowest(self, xy: np.ndarray) -> np.ndarray:
        if self._lowest_grasp_z is None:
            return np.full(np.shape(xy)[:-1], lowest_grasp_z(self.table_z))
        return self._lowest_grasp_z(xy)

    def cleared(self, grasps: np.ndarray) -> np.ndarray:
        """Grasps (n, 4), raised where their pads would be too near the table."""
        if self._lowest_grasp_z is None:
            return grasps
        z = np.maximum(grasps[:, 2], self._lowest_grasp_z(grasps[:, :2]))
        return np.column_stack([grasps[:, :2], z, grasps[:, 3]])


def shortlist(qualities: np.ndarray, top_fraction: float) -> np.ndarray:
    """Find the indices of the best qualities, best first: ``top_fraction`` of them, at least one."""
    n = max(1, int(round(top_fraction * len(qualities))))
    return np.argsort(-qualities, kind="stable")[:n]


def variance_score(mean: np.ndarray, variance: np.ndarray, grasps: np.ndarray, view: PartView) -> np.ndarray:
    """Compute var_x + var_y + var_z + r^2 (var_theta + E |swing|^2) of the seen centre, square metres.

    With r the part's radius of gyration, seen from above, it is to first order the mean squared distance by
    which the part's points miss the places where they were to be: predicted ones, and flat as the part lay.
    A swing is weighted as if the points lay r from its axis: that of a flat part counts twice, that of a tall
    one too little.

    Args:
        mean: (..., k) of the grasp displacement and, with k = 6, the swing.
        variance: (..., k) the same.
        grasps: (..., 4) base frame.
        view: The detected part.
    """
    centre_grasp = centre_in_grasp_frame(view.centre_base, grasps)
    covariance = object_displacement_covariance(mean[..., :4], variance[..., :4], centre_grasp)
    of_centre = np.diagonal(covariance, axis1=-2, axis2=-1)
    turned = of_centre[..., 3] + swing_squared(mean, variance)
    return of_centre[..., :3].sum(axis=-1) + view.gyration_radius**2 * turned


def by_score(qualities: np.ndarray, scores: np.ndarray, config: PlannerConfig) -> np.ndarray:
    """Order grasps (n,) as they would be chosen: of ``sure_quality`` by score, then the others by quality.

    Args:
        qualities: (n,) predicted probabilities of success.
        scores: (n,) of `variance_score`.
        config: Gives ``sure_quality``.
    """
    unsure = qualities < config.sure_quality
    return np.lexsort((np.where(unsure, -qualities, scores), unsure))


def select(qualities: np.ndarray, scores: np.ndarray, config: PlannerConfig) -> int:
    """Select one of the shortlisted grasps, best quality first, of those with at least ``least_quality``."""
    good = np.flatnonzero(qualities >= config.least_quality)
    if config.policy == "quality":
        return int(good[0])
    return int(good[by_score(qualities[good], scores[good], config)[0]])
