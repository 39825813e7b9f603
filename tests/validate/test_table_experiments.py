"""Experiments on the table reproduce textbook physics, and notice a setting that is not the stated one."""

from __future__ import annotations

import pytest

from mskgrasp.validate import table_experiments
from mskgrasp.validate.body_scene import BodyScene, Workshop
from mskgrasp.validate.check import Check
from mskgrasp.validate.table_experiments import free_fall, sliding


def by_name(checks) -> dict[str, Check]:
    return {check.name: check for check in checks}


def test_free_bodies_fall_by_half_g_t_squared_and_keep_their_spin(scene: BodyScene, workshop: Workshop):
    fall, spin = free_fall(scene, workshop)
    assert fall.passed and fall.expected == pytest.approx(0.1962) and fall.unit == "m"
    assert spin.passed and spin.expected == pytest.approx(2.0)


def test_on_another_planet_the_fall_would_fail(scene: BodyScene, workshop: Workshop, monkeypatch):
    monkeypatch.setattr(table_experiments, "GRAVITY", 3.71)
    fall, spin = free_fall(scene, workshop)
    assert not fall.passed and spin.passed


def test_a_block_slides_as_far_as_coulomb_says(scene: BodyScene, workshop: Workshop):
    checks = by_name(sliding(scene, workshop))
    way = checks["way of a block that slides to rest"]
    # 0.5 m/s, friction 0.4.
    assert way.passed and way.expected == pytest.approx(0.25 / (2 * 0.4 * 9.81))
    assert all(check.passed for check in checks.values()) and len(checks) == 4


def test_a_table_with_less_friction_than_stated_fails_every_check(
    scene: BodyScene, workshop: Workshop, monkeypatch
):
    stated = scene.physics.model_copy(update=dict(friction_table_part=0.5))
    monkeypatch.setattr(scene, "physics", stated)
    assert not any(check.passed for check in sliding(scene, workshop))
