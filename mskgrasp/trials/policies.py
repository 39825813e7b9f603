"""Planners of the paper's policies: best quality, or lowest variance of a model among the best."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from hal.camera import RgbdFrame
from hal.cell import PartTracker
from mskgrasp.core.grasp import PartView
from mskgrasp.planning.planner import GraspPlan, Planner, Shortlist, select, shortlist, variance_score
from mskgrasp.planning.scoring import Scene, qualities
from mskgrasp.trials.predictors import PartObservation, Predictor


class Candidates:
    """Candidates of a frame with their predicted qualities; those of the last frame are cached.

    The policies of an experiment plan in equal frames, and most of the planning time goes to qualities.
    """

    def __init__(self, planner: Planner):
        self.planner = planner
        self._last: tuple[bytes, tuple[PartView, np.ndarray, np.ndarray, float]] | None = None

    def of(
        self, frame: RgbdFrame, rng: np.random.Generator
    ) -> tuple[PartView, np.ndarray, np.ndarray, float]:
        """Sample candidates: view of the part, candidates (n, 4), qualities (n,), time taken, seconds.

        Raises:
            NoPartFound: No part is detected.
        """
        key = _frame_key(frame, rng)
        if self._last is None or self._last[0] != key:
            planner, started = self.planner, time.perf_counter()
            view, candidates = planner.sample(frame, rng)
            scene = Scene.of(frame, view, planner.table_z, planner.models.device)
            found = qualities(planner.models, scene, candidates, planner.config.chunk_size)
            self._last = key, (view, candidates, found, time.perf_counter() - started)
        return self._last[1]


def _frame_key(frame: RgbdFrame, rng: np.random.Generator) -> bytes:
    """Equal for equal inputs of a planner."""
    return frame.depth.tobytes() + repr(rng.bit_generator.state).encode()


class RepeatedPlanner:
    """Planner that returns its last plan for an equal frame and generator, as under several corrections."""

    def __init__(self, planner: Planner):
        self._planner = planner
        self._last: tuple[bytes, GraspPlan] | None = None

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> GraspPlan:
        """Plan a grasp of the part in a frame.

        Raises:
            NoPartFound: No part is detected.
            NoGraspFound: No candidate has the required quality.
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
        policy: As in `mskgrasp.planning.config.PlannerConfig`.
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
            NoGraspFound: No candidate has the required quality.
        """
        config = self.candidates.planner.config.model_copy(update={"policy": self.policy})
        view, candidates, found, scoring_s = self.candidates.of(frame, rng)
        scored = time.perf_counter()
        rows = shortlist(found, config.top_fraction)
        pose = None if self.tracker is None else self.tracker.part_pose()
        observation = PartObservation(part=self.part, frame=frame, view=view, pose_base_obj=pose)
        mean, variance = self.predictor.predict(observation, candidates[rows])
        best = Shortlist(rows, mean, variance, variance_score(mean, variance, candidates[rows], view))
        chosen = select(found[rows], best.scores, config)
        selecting_s = time.perf_counter() - scored
        seconds = {"score": scoring_s, "select": selecting_s, "total": scoring_s + selecting_s}
        return GraspPlan.of(view, candidates, found, best, chosen, seconds=seconds)
