"""Planners of the paper's policies, on a box whose qualities and variances follow from the grasps."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import pytest

from hal.camera import RgbdFrame
from mskgrasp.core.errors import NoGraspFound
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import Grasp
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.planner import Planner
from mskgrasp.trials.policies import Candidates, Chooser, RepeatedPlanner
from mskgrasp.trials.predictors import NetworkPredictor, PartObservation
from tests.planning.hand_made import FRAME, planner

CONFIG = PlannerConfig(n_candidates=100, top_fraction=0.3)


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@dataclass
class LeastAlongX:
    """A predictor whose variance grows along base x; it keeps what it was asked."""

    asked: list[PartObservation]
    has_variance: bool = True

    def knows(self, part: str) -> bool:
        return True

    def predict(self, observation: PartObservation, grasps: Grasp) -> tuple[np.ndarray, np.ndarray]:
        self.asked.append(observation)
        variance = np.zeros((len(grasps), 4))
        variance[:, 0] = 1e-6 * (grasps.position[:, 0] - grasps.position[:, 0].min() + 0.001)
        return np.zeros((len(grasps), 4)), variance


class Tracker:
    """Knows the pose of the box."""

    def part_pose(self) -> Pose:
        return Pose(position=np.array([0.45, 0.02, 0.015]), quat_wxyz=np.array([1.0, 0, 0, 0]))


def test_a_models_variances_choose_among_the_best_qualities_of_another():
    asked: list[PartObservation] = []
    candidates = Candidates(planner(CONFIG))
    plan = Chooser(candidates, LeastAlongX(asked), "low_variance", "nut", Tracker()).plan(FRAME, rng())
    best = np.argsort(-plan.qualities, kind="stable")[:30]
    assert set(plan.shortlist.tolist()) == set(best.tolist())
    assert plan.grasp.position[0] == plan.candidates.position[best, 0].min()
    (one,) = asked
    assert one.part == "nut" and one.frame is FRAME and one.pose_base_obj is not None
    np.testing.assert_array_equal(one.pose_base_obj.position, [0.45, 0.02, 0.015])


def test_the_policy_of_the_best_quality_takes_it_whatever_the_variances():
    chooser = Chooser(Candidates(planner(CONFIG)), LeastAlongX([]), "quality", "nut", None)
    plan = chooser.plan(FRAME, rng())
    assert plan.quality == plan.qualities.max()


@pytest.mark.parametrize("policy", ["quality", "low_variance", "recentred"])
def test_with_the_planners_own_model_the_plan_is_the_planners(policy: str):
    settings = {
        "quality": dict(policy="quality"),
        "low_variance": dict(policy="low_variance", recentre=False, sure_quality=0.0),  # as in the paper
        "recentred": dict(policy="low_variance"),
    }
    own: Planner = planner(CONFIG.model_copy(update=settings[policy]))
    network = NetworkPredictor(own.models, CONFIG.chunk_size)
    chosen = Chooser(Candidates(own), network, policy, "nut", None).plan(FRAME, rng())
    expected = own.plan(FRAME, rng())
    np.testing.assert_array_equal(chosen.grasp.as_vector(), expected.grasp.as_vector())
    np.testing.assert_allclose(chosen.shortlist_scores, expected.shortlist_scores)


def test_candidates_are_drawn_once_for_equal_frames_and_generators():
    candidates = Candidates(planner(CONFIG))
    first = candidates.of(FRAME, rng())
    equal = dataclasses.replace(FRAME, depth=FRAME.depth.copy())
    assert candidates.of(equal, rng()).grasps is first.grasps
    assert candidates.of(FRAME, rng(1)).grasps is not first.grasps
    lower = dataclasses.replace(FRAME, depth=FRAME.depth + np.float32(1e-3))
    second = candidates.of(lower, rng(1))
    assert candidates.of(lower, rng(1)).grasps is second.grasps


def test_an_equal_scene_is_planned_once_and_another_anew():
    class Counting:
        """A planner that counts its plans."""

        n = 0
        inner = planner(CONFIG)

        def plan(self, frame: RgbdFrame, generator: np.random.Generator):
            self.n += 1
            return self.inner.plan(frame, generator)

    counting = Counting()
    repeated = RepeatedPlanner(counting)  # type: ignore[arg-type]
    first = repeated.plan(FRAME, rng())
    assert repeated.plan(FRAME, rng()) is first and counting.n == 1
    assert repeated.plan(FRAME, rng(1)) is not first and counting.n == 2


def test_a_scene_without_a_good_grasp_has_no_plan_and_is_asked_again():
    certain = planner(CONFIG.model_copy(update=dict(min_quality=1.0)))
    repeated, chooser = (
        RepeatedPlanner(certain),
        Chooser(Candidates(certain), LeastAlongX([]), "quality", "", None),
    )
    for one in (repeated, repeated, chooser):
        with pytest.raises(NoGraspFound):
            one.plan(FRAME, rng())
