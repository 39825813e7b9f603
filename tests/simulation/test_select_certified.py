"""Which of the simulated grasps of a resting pose are certified, and why the others are not."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mskgrasp.core.settings import ExecutionNoise
from mskgrasp.planning.certified import radius_about_vertical
from mskgrasp.simulation.certify import CertifyConfig, measured
from mskgrasp.simulation.select_certified import Selected, select_certified
from tests.planning.test_certified import certified_grasp
from tests.simulation.test_certify import GRASP, PART, outcomes
from tests.simulation.test_pad_contact import BAR


@pytest.mark.parametrize("differences", [0.0, 0.3, 0.6])
def test_the_best_of_many_grasps_errs_by_as_much_as_is_stated(differences):
    rng, radius, n, step = np.random.default_rng(2), radius_about_vertical(PART, 0), 60, 2e-4
    chosen, least = np.zeros((n, 2)), np.zeros((n, 2))  # stated and true, m^2
    for one in range(n):
        stds = 1e-4 * np.exp(differences * rng.normal(size=12))
        grasps = []
        for k, std in enumerate(stds):
            last, before = (
                outcomes(rng, count, np.zeros((4, 3)), np.zeros(4), std * np.array([1, 1, 0, 0]))
                for count in (24, 6)
            )
            grasps.append(measured(0, radius, GRASP + [step * k, 0, 0, 0], last, before))
        light = dataclasses.replace(PART, mass=1e-3)  # the pads hold it wherever they touch it
        best = select_certified(light, grasps, CertifyConfig()).certified[0]
        seems_best = min(grasps, key=lambda grasp: grasp.spread(radius))
        for row, grasp in ((chosen, best), (least, seems_best)):
            std = stds[round(grasp.grasp[0] / step)]
            row[one] = grasp.spread(radius), (1 + 4 / 30) * 2 * std**2
    stated, true = np.sqrt(chosen.mean(axis=0))
    measured_alone, true_of_that = np.sqrt(least.mean(axis=0))
    assert stated == pytest.approx(true, rel=0.06)
    assert measured_alone < 0.97 * true_of_that


def test_grasps_are_certified_by_lifting_by_hanging_flat_and_by_their_spread():
    config = CertifyConfig()
    good = certified_grasp()
    reasons = {}
    for name, changes in (
        ("lifts", dict(lifted=20)),
        ("tilts", dict(swing=np.array([0.05, 0.0]))),
        ("spreads", dict(residual=np.diag(np.square([5e-3, 0.0, 0.0, 0.0])))),
    ):
        bad = dataclasses.replace(good, **changes)
        assert select_certified(PART, [bad, good], config) == Selected(certified=(good,))
        alone = select_certified(PART, [bad], config)
        kept = () if name == "spreads" else (bad,)  # by 5 mm, of 2 that are allowed
        assert not alone.certified and alone.uncertified == kept
        reasons[name] = alone.reason
    assert select_certified(PART, [], config).reason == "the camera does not see it over the table"
    assert "no grasp lifts it in 95%" in reasons["lifts"] and "83%" in reasons["lifts"]
    assert "2 degrees" in reasons["tilts"]
    assert "spreads by more than 2 mm" in reasons["spreads"]


def test_a_grasp_is_not_certified_whose_part_its_weight_could_turn_between_the_pads():
    """0.6 kg, 25 mm beside the pads, friction 0.4, 30 N: 1.1 of what they hold (`test_pad_contact`)."""
    noise = ExecutionNoise(friction_pad_part=(0.4, 0.4), finger_force=(30.0, 30.0))
    config = CertifyConfig(noise=noise)
    heavy = dataclasses.replace(BAR, mass=0.6)
    # Of the same grasp, the part slid along the pads towards them.
    beside, half, fifth = (
        certified_grasp(
            grasp=np.array([0.025, 0.0, 0.0105, 0.0]),
            mean=np.array([0.025 * share, 0, 0, 0]),
            swing=np.zeros(2),
        )
        for share in (0.0, 0.4, 0.8)
    )
    assert select_certified(heavy, [beside, fifth], config).certified == (fifth,)
    alone = select_certified(heavy, [beside], config)
    assert not alone.certified and "its weight could turn it between the pads" in alone.reason
    # It is kept, where no better one is, up to twice of what they hold.
    assert len(alone.uncertified) == 1
    assert not select_certified(dataclasses.replace(BAR, mass=1.2), [beside], config).uncertified
    # Where all tilt, those are kept that the pads hold, with their own errors.
    tilted = [dataclasses.replace(one, swing=np.array([0.2, 0.0])) for one in (beside, half, fifth)]
    kept = select_certified(heavy, tilted, config).uncertified
    assert len(kept) == 2 and all(one.mean[0] > 0 for one in kept)
    # The tilt shrinks what is touched: a lighter bar is held where it hangs flat, and not as it tilts.
    lighter = dataclasses.replace(BAR, mass=0.5)
    assert len(select_certified(lighter, [beside], config).certified) == 1
    assert len(select_certified(lighter, tilted, config).uncertified) == 2
    # Where one takes a fifth of what the pads hold, none is certified that takes more than half of it.
    assert select_certified(heavy, [half, fifth], config).certified == (fifth,)
    assert select_certified(heavy, [half], config).certified == (half,)
    spreads = dataclasses.replace(fifth, residual=np.diag(np.square([5e-3, 0.0, 0.0, 0.0])))
    assert select_certified(heavy, [half, spreads], config).certified == (half,)


def test_the_least_friction_force_is_a_quantile_of_what_the_simulations_have():
    """Forces are 30 to 50 N: half of them, by a friction of 0.5, exceed 20 N."""
    halves = CertifyConfig(
        noise=ExecutionNoise(friction_pad_part=(0.5, 0.5), finger_force=(30.0, 50.0)), least_lifted=0.5
    )
    assert halves.least_friction_force == pytest.approx(20.0, rel=1e-3)


def test_where_the_part_always_tilts_the_steadiest_of_these_grasps_are_kept():
    tilts = certified_grasp(swing=np.array([0.2, 0.0]))
    wavers = dataclasses.replace(tilts, grasp=GRASP + [0.01, 0, 0, 0], swing_cov=np.diag([0.04, 0.0]))
    found = select_certified(PART, [wavers, tilts], CertifyConfig())
    # 0.2 rad over 15 mm are 3 mm: too much for a flat part, but the same every time.
    assert found.uncertified == (tilts,) and not found.certified and "it tilts" in found.reason


def test_where_no_grasp_lifts_often_enough_those_that_lift_most_often_are_kept():
    often = certified_grasp(lifted=22)
    seldom = dataclasses.replace(often, grasp=GRASP + [0.01, 0, 0, 0], lifted=20)
    tilts = dataclasses.replace(often, grasp=GRASP + [0.02, 0, 0, 0], swing=np.array([0.2, 0.0]))
    spreads = certified_grasp(lifted=22, residual=np.diag(np.square([5e-3, 0.0, 0.0, 0.0])))
    found = select_certified(PART, [seldom, tilts, often, spreads], CertifyConfig())
    assert found.uncertified == (often,) and "best 92%" in found.reason
    # Four in five at least.
    assert not select_certified(PART, [certified_grasp(lifted=19)], CertifyConfig()).uncertified


def test_where_every_outcome_spreads_those_that_do_so_by_twice_as_much_at_most_are_kept():
    wide, wider = (certified_grasp(residual=np.diag(np.square([std, 0.0, 0.0, 0.0]))) for std in (3e-3, 5e-3))
    assert select_certified(PART, [wide], CertifyConfig()).uncertified == (wide,)
    assert not select_certified(PART, [wider], CertifyConfig()).uncertified


def test_certified_grasps_are_spread_over_the_part():
    config = CertifyConfig(kept=2)
    near = [
        certified_grasp(
            grasp=GRASP + [1e-4 * k, 0, 0, 0], residual=np.diag([(1e-4 + 1e-6 * k) ** 2, 0, 0, 0])
        )
        for k in range(3)
    ]
    far = certified_grasp(grasp=GRASP + [0.01, 0, 0, 0], residual=np.diag([(3e-4) ** 2, 0, 0, 0]))
    assert select_certified(PART, [*near, far], config) == Selected(certified=(near[0], far))
