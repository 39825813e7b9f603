"""Experiments in the hand reproduce their formulas, and notice a setting that is not the stated one."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import pytest

from mskgrasp.validate.body_scene import BodyScene, Workshop
from mskgrasp.validate.hand_experiments import centring, holding_limit, torsion, wedge


@pytest.fixture
def misstated(scene: BodyScene, monkeypatch) -> Iterator[BodyScene]:
    """The scene with settings that are not those of its engine: more friction, larger patches."""
    stated = scene.physics.model_copy(update=dict(friction_pad_part=0.7, pad_patch_radius=0.008))
    force = scene.physics.finger_force
    monkeypatch.setattr(scene, "physics", stated)
    yield scene
    scene.env.agent.set_finger_force(force)  # an experiment that is cut short leaves its own


def test_pads_hold_twice_mu_f_r_at_a_point(scene: BodyScene, workshop: Workshop):
    check = next(torsion(scene, workshop))
    assert check.passed and check.unit == "N m"
    assert check.expected == pytest.approx(2 * 0.5 * 30 * 0.005)  # mu, N, m


def test_a_block_beside_the_middle_and_a_turned_one_end_between_the_pads(
    scene: BodyScene, workshop: Workshop
):
    shift, turn = islice(centring(scene, workshop), 2)
    assert shift.passed and shift.expected == -12.0 and shift.unit == "mm"
    assert turn.passed and turn.expected == pytest.approx(-17.19, abs=0.01)


def test_less_friction_than_stated_lets_the_block_slip_too_early(misstated: BodyScene, workshop: Workshop):
    check = next(holding_limit(misstated, workshop))
    assert not check.passed and check.measured < check.low


def test_less_friction_than_stated_squeezes_a_narrower_wedge_out(misstated: BodyScene, workshop: Workshop):
    (check,) = wedge(misstated, workshop)
    assert not check.passed and check.expected == pytest.approx(34.99, abs=0.01)  # atan(0.7)
    assert check.measured < check.low


def test_smaller_patches_than_stated_turn_too_early(misstated: BodyScene, workshop: Workshop):
    check = next(torsion(misstated, workshop))
    assert not check.passed and check.measured < check.low
