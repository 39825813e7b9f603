"""The rule of holding, and loads."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from hal import Load
from hal.hand import holds

LOAD = Load(mass=0.3, centre_tcp=np.array([0.0, 0.0, 0.01]), inertia=1e-4 * np.eye(3))


@pytest.mark.parametrize(
    ("width", "grasped", "holding"),
    [
        (0.03, True, True),
        (0.03, None, True),  # a hand that reports nothing
        (0.03, False, False),  # it gave the part up
        (0.0008, True, False),  # closed on air, which libfranka reports as a grasp of width 0
        (0.001, True, False),
        (-0.0002, None, False),
    ],
)
def test_a_hand_holds_what_keeps_its_pads_apart_unless_it_reports_no_grasp(
    width: float, grasped: bool | None, holding: bool
):
    assert holds(width, grasped, 1e-3) is holding


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"mass": 0.0}, "its mass over 0, got 0.0 kg"),
        ({"mass": np.nan}, "must be finite"),
        ({"centre_tcp": np.array([0.0, np.inf, 0.0])}, "must be finite"),
        ({"centre_tcp": np.zeros(2)}, r"must be \(3,\) and \(3, 3\), got \(2,\)"),
        ({"inertia": np.zeros(9)}, r"got \(3,\), \(9,\)"),
    ],
)
def test_what_is_no_load_is_refused(values: dict[str, Any], message: str):
    with pytest.raises(ValueError, match=message):
        dataclasses.replace(LOAD, **values)
