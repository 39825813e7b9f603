"""Physics settings: what follows from others, and what is refused."""

from __future__ import annotations

import math

import pytest
from pydantic import ValidationError

from mskgrasp.core.settings import Physics


def test_the_coarse_rate_follows_a_lower_rate_unless_another_is_stated():
    assert Physics().coarse_rate_hz == 500
    assert Physics(rate_hz=125).coarse_rate_hz == 125 and Physics(rate_hz=2000).coarse_rate_hz == 500
    assert Physics(rate_hz=200, coarse_rate_hz=100).coarse_rate_hz == 100
    with pytest.raises(ValidationError, match="coarse_rate_hz is at most rate_hz, 200, got 250: lower it"):
        Physics(rate_hz=200, coarse_rate_hz=250)


def test_the_default_finger_is_critically_damped_and_full_force_comes_as_soon_as_documented():
    physics = Physics()
    moved = physics.finger_armature + 0.015  # and the finger itself
    critical = 2 * math.sqrt(physics.finger_stiffness * moved)
    assert physics.finger_damping == pytest.approx(critical, rel=0.01)
    # The drive's target runs ahead of a stopped pad until stiffness times lag is the force less damping.
    lag = (physics.finger_force - physics.finger_damping * physics.finger_speed) / physics.finger_stiffness
    assert lag / physics.finger_speed == pytest.approx(0.062, abs=1e-3)


def test_settings_are_read_back_equal_from_what_a_shard_stores():
    physics = Physics(rate_hz=500, friction_pad_part=0.3, skip_air=False)
    assert Physics.model_validate(physics.model_dump(mode="json")) == physics


@pytest.mark.parametrize(
    "values",
    [
        dict(rate_hz=99), dict(position_iterations=3), dict(finger_force=71), dict(finger_speed=0),
        dict(hold_s=0.1), dict(lift_height=0.31), dict(contact_offset=0), dict(friction=0.5),
        dict(position_iterations=256), dict(hold_iterations=256),
    ],
)  # fmt: skip
def test_what_the_arm_or_the_engine_cannot_do_is_refused(values: dict[str, float]):
    with pytest.raises(ValidationError):
        Physics.model_validate(values)
