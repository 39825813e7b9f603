"""Settings of the physics, and what they refuse."""

from __future__ import annotations

import pytest

from hal.mujoco import MujocoCellConfig


@pytest.mark.parametrize(
    ("physics", "message"),
    [
        ({"contact_time_s": 0.0015}, "at least two steps"),
        ({"contact_impedance": [0.99, 0.9, 0.001]}, "contact_impedance must be"),
    ],
)
def test_contacts_that_mujoco_would_silently_soften_are_refused(physics: dict, message: str):
    with pytest.raises(ValueError, match=message):
        MujocoCellConfig(type="mujoco", physics=physics)  # type: ignore[arg-type]
