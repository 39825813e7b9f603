import contextlib
import dataclasses
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import torch

from mskgrasp.core.errors import BadModel, GraspRefused, NoGraspFound, NoPartFound, TableTooHigh
from mskgrasp.core.grasp import centre_in_grasp_frame, to_object_displacement
from mskgrasp.learning.compute_device import compute_device
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.perception.part_detection import view_part
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.planning.planner import (
    PROMISING,
    RECENTRED,
    Planner,
    by_score,
    select,
    shortlist,
    variance_score,
)
from mskgrasp.planning.refine import hand_room
from mskgrasp.planning.scoring import Scene, displacements
from tests import synthetic
from tests.planning.hand_made import BOX, FRAME, hand_made_models, planner
from tests.planning.threads import torch_threads
from tests.synthetic import REGION, Box


def test_the_planned_grasp_is_the_least_uncertain_of_the_best():
    config = PlannerConfig(n_candidates=600, top_fraction=0.05, sure_quality=0.0, recentre=False)
    plan = planner(config).plan(FRAME, np.random.default_rng(0))
    centre = plan.candidates.T_base_grasp.inverse().apply(plan.view.centre_base)
    best = np.argsort(np.abs(centre[:, 0]))[:30]  # quality falls with |centre x|
    chosen = best[np.argmin(centre[best, 1])]  # and variance rises with centre y
    assert np.allclose(plan.grasp.as_vector(), plan.candidates[chosen].as_vector())
    assert set(plan.shortlist.tolist()) == set(best.tolist())
    assert plan.quality == plan.qualities[chosen] < plan.qualities.max()
    assert plan.score == plan.shortlist_scores.min()


def test_the_quality_policy_takes_the_best_and_needs_no_variance():
    config = PlannerConfig(n_candidates=600, policy="quality")
    plan = planner(config, hand_made_models(variance=False)).plan(FRAME, np.random.default_rng(0))
    assert plan.quality == plan.qualities.max()
    assert np.isnan(np.diag(plan.grasp_displacement_cov)).all() and plan.to_json()["score"] is None
    for policy in ("low_variance", "certified"):  # which plans by the networks where nothing is certified
        with pytest.raises(BadModel, match="policy: quality"):
            planner(PlannerConfig(policy=policy), hand_made_models(variance=False))


def test_the_same_generator_gives_the_same_plan_whatever_the_chunks():
    plans = [
        planner(PlannerConfig(n_candidates=300, chunk_size=size)).plan(FRAME, np.random.default_rng(5))
        for size in (7, 300)
    ]
    assert np.array_equal(plans[0].grasp.as_vector(), plans[1].grasp.as_vector())
    assert np.allclose(plans[0].qualities, plans[1].qualities, atol=1e-6)


def test_the_same_generator_gives_the_same_plan_whatever_the_number_of_threads():
    plans = []
    for n in (1, 2, 3):
        with torch_threads(n):
            one = Planner(load_models(), PlannerConfig(n_candidates=600), table_z=0.0, region=REGION)
            plans.append(one.plan(FRAME, np.random.default_rng(5)))
    for other in plans[1:]:
        assert np.array_equal(other.qualities, plans[0].qualities)
        assert np.array_equal(other.shortlist_scores, plans[0].shortlist_scores)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
def test_a_gpu_finds_as_good_a_grasp_as_a_cpu():
    plans = [
        Planner(
            load_models(device=compute_device(device)),
            PlannerConfig(n_candidates=600),
            table_z=0.0,
            region=REGION,
        ).plan(FRAME, np.random.default_rng(5))
        for device in ("cpu", "cuda")
    ]
    assert np.allclose(plans[1].qualities, plans[0].qualities, atol=1e-5)
    assert plans[1].score == pytest.approx(plans[0].score, rel=1e-3)


def test_one_view_of_the_best_qualities_says_which_are_seen_in_all():
    def plan(**settings: Any) -> GraspPlan:
        config = PlannerConfig(n_candidates=1000, top_fraction=0.06, recentre=False, **settings)
        return Planner(load_models(), config, table_z=0.0, region=REGION).plan(
            FRAME, np.random.default_rng(1)
        )

    first = plan()
    best = shortlist(first.qualities, 0.06)
    scene = Scene.of(FRAME, first.view, 0.0, torch.device("cpu"))
    grasps = first.candidates.as_vector()[best]
    one, every = (
        variance_score(
            *displacements(load_models(), scene, grasps, 800, all_views=all_views), grasps, first.view
        )
        for all_views in (False, True)
    )
    promising = np.sort(by_score(first.qualities[best], one, PlannerConfig())[:PROMISING])
    assert first.shortlist.tolist() == best[promising].tolist()
    assert np.allclose(first.shortlist_scores, every[promising], rtol=1e-4)
    assert first.score == first.shortlist_scores.min()
    # What is not good enough takes no one's place.
    least = float(first.qualities[best[40]])
    assert (first.qualities[first.shortlist] < least).any()
    demanding = plan(min_quality=least)
    assert len(demanding.shortlist) == PROMISING and demanding.quality >= least
    assert (demanding.qualities[demanding.shortlist] >= least).all()
    assert plan(policy="quality").shortlist.tolist() == best[:PROMISING].tolist()


def test_the_best_are_tried_where_the_part_would_come_to_lie_and_move_less_there():
    models = load_models()

    def plan(**settings: Any) -> GraspPlan:
        config = PlannerConfig(n_candidates=800, **settings)
        return Planner(models, config, table_z=0.0, region=REGION).plan(FRAME, np.random.default_rng(1))

    first, recentred = plan(recentre=False), plan()
    assert np.array_equal(recentred.candidates[:800].as_vector(), first.candidates.as_vector())
    more = recentred.candidates[800:].as_vector()
    assert 0 < len(more) <= RECENTRED and recentred.score < first.score
    shortlisted = float(first.qualities[shortlist(first.qualities, 0.03)].min())
    least = min(PlannerConfig().sure_quality, shortlisted)
    assert (recentred.qualities[800:] >= least).all() and recentred.quality >= least
    none_sure = plan(sure_quality=0.0).qualities[800:]
    assert 0 < len(none_sure) < RECENTRED and (none_sure >= shortlisted).all()
    scene = Scene.of(FRAME, first.view, 0.0, torch.device("cpu"))
    shown = first.candidates[first.shortlist].as_vector()
    moves = [
        np.median(np.abs(displacements(models, scene, grasps, 800)[0][:, 1])) for grasps in (shown, more)
    ]
    assert moves[1] < 0.5 * moves[0]  # along the closing direction
    assert len(plan(policy="quality").candidates) == 800


def test_demands_that_no_candidate_meets_and_empty_tables_are_reported():
    with pytest.raises(NoGraspFound, match="min_quality"):
        planner(PlannerConfig(n_candidates=50, min_quality=0.99)).plan(FRAME, np.random.default_rng(0))
    with pytest.raises(NoPartFound):
        planner().plan(synthetic.frame([]), np.random.default_rng(0))


def test_the_shortlist_is_the_best_share_and_never_empty():
    qualities = np.random.default_rng(0).permutation(np.arange(200) / 200)
    best = shortlist(qualities, 0.03)
    assert qualities[best].tolist() == pytest.approx([0.995, 0.99, 0.985, 0.98, 0.975, 0.97])
    assert len(shortlist(qualities[:3], 0.03)) == 1


def test_selection_minimises_the_score_among_those_good_enough():
    qualities, scores = np.array([0.9, 0.8, 0.7]), np.array([3.0, 2.0, 1.0])
    assert select(qualities, scores, PlannerConfig(sure_quality=0.0)) == 2
    assert select(qualities, scores, PlannerConfig(sure_quality=0.0, min_quality=0.75)) == 1
    assert select(qualities, scores, PlannerConfig(policy="quality")) == 0


def test_grasps_of_sure_quality_come_first_by_score_and_then_the_others_by_quality():
    qualities, scores = np.array([0.99, 0.96, 0.94, 0.9]), np.array([4.0, 3.0, 2.0, 1.0])
    assert by_score(qualities, scores, PlannerConfig()).tolist() == [1, 0, 2, 3]
    assert by_score(qualities, scores, PlannerConfig(sure_quality=0.0)).tolist() == [3, 2, 1, 0]
    assert select(qualities, scores, PlannerConfig()) == 1
    assert select(qualities[2:], scores[2:], PlannerConfig()) == 0
    assert len(by_score(np.zeros(0), np.zeros(0), PlannerConfig())) == 0


def test_the_score_is_the_mean_squared_error_of_the_parts_points():
    rng = np.random.default_rng(0)
    mean, std = np.array([0.004, -0.003, 0.001, 0.3]), np.array([0.001, 0.002, 0.0005, 0.05])
    grasp = np.array([0.5, 0.1, 0.02, 0.7])
    points = np.array([0.52, 0.09, 0.03]) + rng.normal(size=(500, 3)) * [0.01, 0.01, 0.0]
    centre = points.mean(axis=0)
    view = dataclasses.replace(
        planner().plan(FRAME, rng).view,
        centre_base=centre,
        gyration_radius=float(np.sqrt(((points - centre) ** 2).sum(axis=1).mean())),
    )
    drawn = np.repeat(mean + std * rng.normal(size=(2000, 1, 4)), 500, axis=1)
    points_grasp = centre_in_grasp_frame(points, grasp)
    expected = to_object_displacement(np.tile(mean, (500, 1)), points_grasp)
    missed = to_object_displacement(drawn, points_grasp) - expected
    squared = (missed[..., :3] ** 2).sum(axis=-1)
    score = variance_score(mean[None], std[None] ** 2, grasp[None], view)
    assert score[0] == pytest.approx(squared.mean(), rel=0.06)


def test_a_part_that_swings_has_a_worse_score_by_its_mean_and_its_spread():
    view = planner().plan(FRAME, np.random.default_rng(0)).view
    grasp = np.array([[view.centre_base[0], view.centre_base[1], 0.02, 0.0]])
    flat, swung = np.zeros((1, 4)), np.array([[0, 0, 0, 0, 0.1, -0.2]])
    variance = np.full((1, 6), 1e-4)
    more = variance_score(swung, variance, grasp, view) - variance_score(flat, variance[:, :4], grasp, view)
    assert more[0] == pytest.approx(view.gyration_radius**2 * (0.01 + 0.04 + 2e-4))


def test_a_grasp_beside_which_something_stands_is_left_out():
    other = Box(
        x=BOX.x - 0.055 * np.sin(0.4), y=BOX.y + 0.055 * np.cos(0.4), yaw=0.4, size=(0.02, 0.01, 0.03)
    )
    frame = synthetic.frame([BOX, other])
    view = view_part(frame.depth, frame.intrinsics, frame.T_base_camera, table_z=0.0, region=REGION)
    scene = Scene.of(frame, view, 0.0, torch.device("cpu"))
    checked = planner(PlannerConfig(n_candidates=400, check_fingers=True))
    plan = checked.plan(frame, np.random.default_rng(0))
    assert hand_room(scene, plan.candidates[plan.shortlist].as_vector())[0].all()
    assert 12 <= len(plan.shortlist) < 24 and (plan.shortlist >= 400).any()  # recentred ones, too
    free = planner(PlannerConfig(n_candidates=400)).plan(frame, np.random.default_rng(0))
    assert not hand_room(scene, free.candidates[free.shortlist].as_vector())[0].all()


@pytest.mark.slow
def test_planning_on_a_real_cell_loads_no_simulator():
    code = (
        "import sys\n"
        "for name in ('sapien', 'mani_skill', 'mujoco'): sys.modules[name] = None\n"
        "from mskgrasp.planning import for_cell, place_pose, planner, refine, run_inputs, scoring"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_two_parts_are_refused():
    other = Box(x=0.45, y=-0.06, yaw=0.0, size=(0.04, 0.02, 0.02))
    with pytest.raises(NoPartFound, match="two things lie in the region.*take one away"):
        planner().plan(synthetic.frame([BOX, other]), np.random.default_rng(0))


def test_a_part_that_is_known_to_be_flat_is_seen_and_refused_as_such():
    flat = synthetic.frame([Box(x=0.5, y=0.0, yaw=0.0, size=(0.06, 0.09, 0.0018))])
    demanding = PlannerConfig(n_candidates=600, min_quality=0.999)
    with pytest.raises(NoPartFound, match="nothing rises"):
        planner(demanding).plan(flat, np.random.default_rng(0))
    known = planner(demanding).for_part(0.0018)
    assert known.view(flat).size[2] == pytest.approx(0.0018, abs=1e-5)
    with pytest.raises(GraspRefused):
        known.plan(flat, np.random.default_rng(0))


def test_no_candidate_is_lower_than_the_cell_allows():
    def lowest(xy: np.ndarray) -> np.ndarray:
        return 0.02 + 0.01 * (xy[:, 0] - 0.5)

    found = planner(PlannerConfig(n_candidates=600), lowest_grasp_z=lowest)
    candidates = found.plan(FRAME, np.random.default_rng(0)).candidates.as_vector()
    assert (candidates[:, 2] >= lowest(candidates[:, :2]) - 1e-12).all()
    free = planner(PlannerConfig(n_candidates=600)).plan(FRAME, np.random.default_rng(0))
    assert (free.candidates.as_vector()[:, 2] < 0.0195).any()


@pytest.mark.parametrize(("offset", "refused"), [(0.0015, False), (-0.004, False), (0.0025, True)])
def test_a_table_seen_more_than_2_mm_too_high_is_refused(offset: float, refused: bool):
    depth = FRAME.depth + np.random.default_rng(0).normal(0, 0.002, FRAME.depth.shape).astype(np.float32)
    frame = dataclasses.replace(FRAME, depth=(depth - offset).astype(np.float32))
    with pytest.raises(TableTooHigh, match=r"run hal\.touch") if refused else contextlib.nullcontext():
        planner(min_height=0.006).sample(frame, np.random.default_rng(0))
