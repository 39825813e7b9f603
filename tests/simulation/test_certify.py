"""Rounds of the certification, and what is concluded from them."""

from __future__ import annotations

from contextlib import closing
from types import SimpleNamespace

import numpy as np
import pytest

from mskgrasp.core.geometry import wrap_half_turn
from mskgrasp.core.grasp import pose_base_grasp
from mskgrasp.core.settings import REGION, TABLE_Z, Overhead
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts import find_part
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.planner import Planner
from mskgrasp.simulation import certify
from mskgrasp.simulation.certify import (
    CertifyConfig,
    Member,
    Stream,
    _Candidate,
    _first_held,
    _without_motion,
    candidate_grasps,
    measured,
    round_sizes,
    run_stream,
)
from mskgrasp.simulation.pad_contact import HeldPart, moment_share
from mskgrasp.simulation.repeats import Repeat
from mskgrasp.simulation.shard import Simulator
from tests.boxes import make_box

PART = find_part("hex_nut_m20")
GRASP = np.array([0.0, 0.0, 0.0105, 0.0])


@pytest.mark.parametrize("simulations", [24, 40, 100, 200, 500])
def test_the_rounds_use_up_the_simulations(simulations):
    n_first, n_second, n_last, last = round_sizes(simulations)
    used = 2 * n_first + 4 * n_second + last * n_last
    assert 0.9 * simulations <= used <= simulations + 4
    assert n_second <= 2 * n_first and n_last >= 1


def outcomes(rng: np.random.Generator, n: int, slope: np.ndarray, mean: np.ndarray, std: np.ndarray):
    found = []
    for _ in range(n):
        error = rng.normal(size=4) * [3e-4, 3e-4, 2e-4, 5e-3]
        moved = mean + slope @ error[[0, 1, 3]] + std * rng.normal(size=4)
        found.append(Repeat(reason="", error=error, displacement=moved, swing=np.array([0.001, 0.0])))
    return found


def test_the_outcome_follows_the_error_of_the_pose_along_the_line_that_made_it():
    rng = np.random.default_rng(0)
    slope = np.array([[1.0, 0.1, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 5.0, 1.0]])
    mean, std = np.array([1e-3, -2e-3, 1e-4, 0.05]), np.array([5e-5, 1e-5, 5e-5, 1e-3])
    last = outcomes(rng, 400, slope, mean, std)
    failed = Repeat(reason="slipped", error=np.zeros(4), displacement=np.full(4, np.nan), swing=np.zeros(2))
    grasp = measured(0, 0.01, GRASP, [*last, failed], outcomes(rng, 20, slope, mean, std))
    assert (grasp.n, grasp.lifted) == (401, 400)
    assert grasp.mean == pytest.approx(mean, abs=3e-4)
    assert grasp.slope[0] == pytest.approx(slope[0], abs=0.05)
    assert np.sqrt(np.diag(grasp.residual)) == pytest.approx(std, rel=0.15)
    assert grasp.swing == pytest.approx([0.001, 0.0])


def test_the_residual_of_few_outcomes_is_that_of_a_new_one_about_the_fitted_line():
    rng = np.random.default_rng(1)
    std = np.array([1e-4, 1e-4, 1e-4, 1e-3])
    found = [
        np.diag(
            measured(
                0, 0.01, GRASP, outcomes(rng, 24, np.zeros((4, 3)), np.zeros(4), std),
                outcomes(rng, 6, np.zeros((4, 3)), np.zeros(4), std),
            ).residual
        )
        for _ in range(200)
    ]  # fmt: skip
    assert np.mean(found, axis=0) == pytest.approx((1 + 4 / 30) * std**2, rel=0.1)


def test_a_grasp_that_never_lifts_has_no_outcome():
    failed = Repeat(
        reason="missed", error=np.zeros(4), displacement=np.full(4, np.nan), swing=np.full(2, np.nan)
    )
    grasp = measured(0, 0.01, GRASP, [failed] * 5)
    assert (grasp.lifted, grasp.n) == (0, 5)
    assert np.isfinite(grasp.mean).all() and not grasp.mean.any()


def lifted(*displacement: float, swing: float = 0.0) -> Repeat:
    return Repeat(
        reason="", error=np.zeros(4), displacement=np.array(displacement), swing=np.array([swing, 0.0])
    )


DROPPED = Repeat(
    reason="slipped", error=np.zeros(4), displacement=np.full(4, np.nan), swing=np.full(2, np.nan)
)


def test_candidates_are_ranked_by_spread_swing_and_failures():
    known = [lifted(0, 0, 0, 0), lifted(2e-3, 0, 0, 0.1, swing=0.1)]
    steady = _Candidate(GRASP, known)
    # By hand: variances 2e-6 m^2 and 0.005, mean squared swing 0.005, radius 20 mm.
    assert steady.score(0.02) == pytest.approx(2e-6 + 0.02**2 * (0.005 + 0.005))
    failing = _Candidate(GRASP, [*known, DROPPED])
    assert failing.score(0.02) == pytest.approx(steady.score(0.02) + certify.FAILED**2 / 3)
    assert _Candidate(GRASP, [known[0], DROPPED]).score(0.02) > failing.score(0.02)


@pytest.mark.parametrize("grasp", [[0.0, 0.0, 0.0105, 0.0], [0.004, -0.003, 0.0105, 1.2]])
def test_a_part_grasped_where_it_came_to_lie_would_not_have_moved(grasp):
    """It lies at the origin of its rest frame, and is to have the pose in the hand that it took before."""
    grasp = np.array(grasp)
    moved = np.array([3e-3, -1e-3, 0.0, 0.2])
    again = _without_motion(_Candidate(grasp, [lifted(*moved), lifted(*moved), DROPPED]), 0.01, 0.012)
    assert again is not None and again[2] == 0.012
    part = np.array([0.0, 0.0, 0.01])
    came_to = pose_base_grasp(grasp).inverse().apply(part) + moved[:3]
    assert pose_base_grasp(again).inverse().apply(part)[:2] == pytest.approx(came_to[:2], abs=1e-9)
    assert wrap_half_turn(np.asarray(-again[3] - (-grasp[3] + moved[3]))) == pytest.approx(0, abs=1e-9)


def test_a_grasp_that_lifts_nothing_or_lets_the_part_swing_is_not_moved():
    assert _without_motion(_Candidate(GRASP, [DROPPED]), 0.01, 0.0105) is None
    assert _without_motion(_Candidate(GRASP, [lifted(1e-3, 0, 0, 0, swing=0.2)]), 0.01, 0.0105) is None


def test_candidates_meet_the_same_scenes_and_the_steadiest_is_kept(monkeypatch):
    """Outcomes by a formula: the farther from the middle, the more they spread."""
    met: dict[float, list[tuple[int, ...]]] = {}

    def repeat_by_formula(env, which, grasp, errors, seed, *, offset):
        met.setdefault(float(grasp[0]), []).append(seed)
        noise = np.random.default_rng(seed).normal(size=4) * [1, 1, 1, 0]
        return lifted(*((1e-4 + abs(grasp[0])) * noise * 0.1))

    places = np.linspace(-0.05, 0.04, 10)
    grasps = [np.array([x, 0.0, 0.0105, 0.0]) for x in places]
    monkeypatch.setattr(certify, "repeat_grasp", repeat_by_formula)
    monkeypatch.setattr(certify, "candidate_grasps", lambda *_: grasps)
    stream = Stream(
        part="any", resting=0, members=(Member(which=0, turn=0.0, probability=1.0),), number=0, simulations=60
    )
    standing = SimpleNamespace(poses=SimpleNamespace(position=np.array([[0.0, 0.0, 0.01]])))
    run = run_stream(SimpleNamespace(parts=[PART], standing=[standing]), None, stream, CertifyConfig())  # pyright: ignore
    while True:
        try:
            next(run)
        except StopIteration as end:
            kept = end.value
            break
    first = [tuple(seeds[: certify.FIRST]) for x, seeds in met.items() if x in places]
    assert len(first) == 10 and len(set(first)) == 1 and len(set(first[0])) == certify.FIRST
    assert {one.n for one in kept} == {round_sizes(60)[3]}
    assert abs(kept[0].grasp[0]) == min(abs(places))


LITTLE = 7.0
"""Friction of a pad that lifts the bar below, and holds it about 10 mm beside its middle, N."""


def test_candidates_are_first_those_whose_pads_hold_the_parts_weight(tmp_path):
    """A bar of 0.8 kg: the networks like grasps all along it, but far from its middle it would turn."""
    config = CertifyConfig()
    part = make_box(tmp_path, "bar", (0.12, 0.024, 0.02), 0.8)
    planner = Planner(load_models(PRETRAINED, "cpu"), PlannerConfig(), table_z=TABLE_Z, region=REGION)
    stream = Stream(
        part=str(part.folder),
        resting=0,
        members=(Member(which=0, turn=0.0, probability=1.0),),
        number=0,
        simulations=200,
    )
    with closing(Simulator(config.physics, Overhead(), config.noise)) as simulator:
        env = simulator.load(stream.part)
        far = {}
        for friction in (LITTLE, 1e6):
            rng = np.random.default_rng(0)
            grasps = np.array(candidate_grasps(env, planner, stream, rng, 10, friction))
            far[friction] = np.hypot(grasps[:, 0], grasps[:, 1])
    assert far[LITTLE].max() < 0.02 < far[1e6].max()


def test_grasps_that_hold_come_before_others_and_those_apart_before_those_near(tmp_path):
    bar = make_box(tmp_path, "bar", (0.12, 0.024, 0.02), 0.8)

    def at(x: float) -> HeldPart:
        grasp = np.array([x, 0.0, 0.01, 0.0])
        return HeldPart(part=bar, resting=0, grasp=grasp, displacement=np.zeros(4), swing=np.zeros(2))

    liked = [at(x) for x in (0.05, 0.0, 0.001, -0.05, 0.008)]
    assert [held.grasp[0] for held in liked if moment_share(held, LITTLE) > 1] == [0.05, -0.05]
    for n, places in ((2, [0.0, 0.008]), (3, [0.0, 0.008, 0.001]), (5, [0.0, 0.008, 0.001, 0.05, -0.05])):
        assert [grasp[0] for grasp in _first_held(liked, n, LITTLE)] == places
