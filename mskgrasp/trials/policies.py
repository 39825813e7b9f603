"""Policies of the paper's experiments: by quality, or by a model's variance among the best."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from hal.camera import RgbdFrame
from hal.cell import PartTracker
from mskgrasp.core.grasp import PartView
from mskgrasp.planning.planner import GraspPlan, Planner, Shortlist, select, shortlist, variance_score
from mskgrasp.planning.scoring import Scene, qualities
from mskgrasp.trials.predictors import Predictor, Seen


class Candidates:
    """Candidates over a frame with their predicted qualities; those of the last frame are remembered.

    The policies of an experiment meet the same part at the same place: what the quality network says of it is
    the same, too, and is by far the most that planning costs.
    """

    def __init__(self, planner: Planner):
        self.planner = planner
        self._last: tuple[bytes, tuple[PartView, np.ndarray, np.ndarray, float]] | None = None

    def of(
        self, frame: RgbdFrame, rng: np.random.Generator
    ) -> tuple[PartView, np.ndarray, np.ndarray, float]:
        """The part's view, candidates (n, 4), their qualities (n,), and the seconds that it took.

        Raises:
            NoPartFound: The frame shows none.
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
    """A planner that returns its last plan for the same frame and candidates, as under other corrections."""

    def __init__(self, planner: Planner):
        self._planner = planner
        self._last: tuple[bytes, GraspPlan] | None = None

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> GraspPlan:
        """Plans a grasp of the part that a frame shows.

        Raises:
            NoPartFound: The frame shows none.
            NoGraspFound: No candidate is of the demanded quality.
        """
        key = _frame_key(frame, rng)
        if self._last is None or self._last[0] != key:
            self._last = key, self._planner.plan(frame, rng)
        return self._last[1]


@dataclass(frozen=True)
class Chooser:
    """Plans with the qualities of one model and the displacements of another.

    Attributes:
        candidates: Where the qualities come from.
        predictor: Predicts the displacement, and with the policy ``low_variance`` decides by its variances.
        policy: As in `mskgrasp.planning.planner.PlannerConfig`.
        part: Name of what lies on the table.
        tracker: Source of its pose for a predictor that needs it.
    """

    candidates: Candidates
    predictor: Predictor
    policy: str
    part: str
    tracker: PartTracker | None

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> GraspPlan:
        """Plans a grasp of the part that a frame shows.

        Raises:
            NoPartFound: The frame shows none.
            NoGraspFound: No candidate is of the demanded quality.
        """
        config = self.candidates.planner.config.model_copy(update={"policy": self.policy})
        view, candidates, found, scoring_s = self.candidates.of(frame, rng)
        scored = time.perf_counter()
        rows = shortlist(found, config.top_fraction)
        pose = None if self.tracker is None else self.tracker.part_pose()
        seen = Seen(part=self.part, frame=frame, view=view, pose_base_obj=pose)
        mean, variance = self.predictor.predict(seen, candidates[rows])
        best = Shortlist(rows, mean, variance, variance_score(mean, variance, candidates[rows], view))
        chosen = select(found[rows], best.scores, config)
        selecting_s = time.perf_counter() - scored
        seconds = {"score": scoring_s, "select": selecting_s, "total": scoring_s + selecting_s}
        return GraspPlan.of(view, candidates, found, best, chosen, seconds=seconds)
