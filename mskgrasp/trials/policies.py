"""Planners of the paper's policies: best quality, or lowest variance of a model among the best."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from hal.camera import RgbdFrame
from hal.cell import PartTracker
from mskgrasp.core.grasp import Grasp, PartView
from mskgrasp.planning.certified_planner import CertifiedPlanner
from mskgrasp.planning.grasp_plan import GraspPlan, Shortlist
from mskgrasp.planning.planner import Planner, select, shortlist, variance_score
from mskgrasp.planning.scoring import Scene, qualities
from mskgrasp.trials.predictors import PartObservation, Predictor


@dataclass(frozen=True, kw_only=True)
class ScoredGrasps:
    """Grasps sampled over a part, with their predicted qualities.

    Attributes:
        view: The detected part.
        grasps: The n grasps.
        qualities: (n,) predicted probabilities of success.
        seconds: Time taken.
    """

    view: PartView
    grasps: Grasp
    qualities: np.ndarray
    seconds: float


class Candidates:
    """Candidates of a frame with their predicted qualities; those of the last frame are cached.

    The policies of an experiment plan in equal frames, and most of the planning time goes to qualities.
    """

    def __init__(self, planner: Planner):
        self.planner = planner
        self._last: tuple[bytes, ScoredGrasps] | None = None

    def of(self, frame: RgbdFrame, rng: np.random.Generator) -> ScoredGrasps:
        """Sample candidates and predict their qualities.

        Raises:
            NoPartFound: No part is detected.
        """
        key = _frame_key(frame, rng)
        if self._last is None or self._last[0] != key:
            planner, started = self.planner, time.perf_counter()
            view, grasps = planner.sample(frame, rng)
            scene = Scene.of(frame, view, planner.table_z, planner.models.device)
            found = qualities(planner.models, scene, grasps.as_vector(), planner.config.chunk_size)
            self._last = (
                key,
                ScoredGrasps(
                    view=view, grasps=grasps, qualities=found, seconds=time.perf_counter() - started
                ),
            )
        return self._last[1]


def _frame_key(frame: RgbdFrame, rng: np.random.Generator) -> bytes:
    """Equal for equal inputs of a planner."""
    return frame.depth.tobytes() + repr(rng.bit_generator.state).encode()


class RepeatedPlanner:
    """Planner that returns its last plan for an equal frame and generator, as under several corrections."""

    def __init__(self, planner: Planner | CertifiedPlanner):
        self._planner = planner
        self._last: tuple[bytes, GraspPlan] | None = None

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> GraspPlan:
        """Plan a grasp of the part in a frame.

        Raises:
            NoPartFound: No part is detected.
            GraspRefused: No candidate has the required quality.
        """
        key = _frame_key(frame, rng)
        if self._last is None or self._last[0] != key:
            self._last = key, self._planner.plan(frame, rng)
        return self._last[1]


@dataclass(frozen=True)
class Chooser:
    """Planner with the qualities of one model and the displacements of another.

    Attributes:
        candidates: Source of candidates and qualities.
        predictor: Predicts displacements, and the variances of the policy ``low_variance``.
        policy: ``quality``; ``low_variance``, as in the paper: among all of the best, whatever their quality;
            ``recentred``, the planner's own ``low_variance``: with recentred grasps and ``sure_quality``.
        part: Name of the part on the table.
        tracker: Source of its pose for a predictor that needs it; None: no pose.
    """

    candidates: Candidates
    predictor: Predictor
    policy: str
    part: str
    tracker: PartTracker | None

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> GraspPlan:
        """Plan a grasp of the part in a frame.

        Raises:
            NoPartFound: No part is detected.
            GraspRefused: No candidate has the required quality.
        """
        planner = self.candidates.planner
        changes: dict[str, Any] = {"policy": "low_variance" if self.policy == "recentred" else self.policy}
        if self.policy == "low_variance":
            changes["sure_quality"] = 0.0
        config = planner.config.model_copy(update=changes)
        scored_grasps = self.candidates.of(frame, rng)
        view, found, scoring_s = scored_grasps.view, scored_grasps.qualities, scored_grasps.seconds
        scored = time.perf_counter()
        rows, candidates = shortlist(found, config.top_fraction), scored_grasps.grasps.as_vector()
        planner.refuse_poor(frame, view, candidates, found[rows])
        pose = None if self.tracker is None else self.tracker.part_pose()
        observation = PartObservation(part=self.part, frame=frame, view=view, pose_base_obj=pose)

        def predict(grasps: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            mean, variance = self.predictor.predict(observation, Grasp.from_vector(grasps))
            return mean, variance, variance_score(mean, variance, grasps, view)

        if self.policy == "recentred":
            scene = Scene.of(frame, view, planner.table_z, planner.models.device)
            candidates, found, best = planner.recentred(scene, candidates, found, rows, predict)
        else:
            best = Shortlist(rows, *predict(candidates[rows]))
        chosen = select(found[best.rows], best.scores, config)
        selecting_s = time.perf_counter() - scored
        seconds = {"score": scoring_s, "select": selecting_s, "total": scoring_s + selecting_s}
        return GraspPlan.of(view, Grasp.from_vector(candidates), found, best, chosen, seconds=seconds)
