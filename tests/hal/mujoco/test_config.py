"""Settings of the physics, and what they refuse."""

from __future__ import annotations

import pytest

from hal.mujoco import MujocoCellConfig
from hal.mujoco.config import MujocoPhysics
from mskgrasp.core.config import check_config
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.settings import Physics


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


def test_quantities_of_the_real_cell_are_those_of_the_sapien_cell():
    """The same part in the same hand: friction, pads, fingers and reflex do not depend on the simulator."""
    own, other = MujocoPhysics(), Physics()
    common = set(MujocoPhysics.model_fields) & set(Physics.model_fields)
    assert {"friction_pad_part", "pad_patch_radius", "finger_speed", "reflex_force"} <= common
    assert {name: getattr(own, name) for name in common} == {name: getattr(other, name) for name in common}


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"step_s": 0.002}, "'step_s': input should be less than or equal to 0.0015"),
        ({"step_s": 0.0}, "'step_s'"),
        ({"friction_pad_part": -0.1}, "'friction_pad_part'"),
        ({"pad_pieces": 5}, "'pad_pieces': input should be less than or equal to 4"),
        ({"collision": "mesh"}, "'hulls' or 'sdf'"),
        ({"contact_impedance": [0.3, 1.0, 1e-5]}, "got [0.3, 1.0, 1e-05]"),
        ({"contact_impedance": [0.3, 0.9, 0.0]}, "and a width > 0"),
        ({"finger_sped": 0.1}, "unknown key 'finger_sped'; legal keys here: "),
    ],
)
def test_a_wrong_value_is_one_line_that_names_it(values: dict, message: str):
    with pytest.raises(BadConfig) as caught:
        check_config(MujocoPhysics, values, "physics")
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_the_shortest_contact_is_two_steps():
    assert MujocoPhysics(step_s=0.0005, contact_time_s=0.001).contact_time_s == 0.001
