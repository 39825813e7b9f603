"""Planned grasp: expected displacement, plain values and picture."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from mskgrasp.core.grasp import centre_in_grasp_frame
from mskgrasp.planning.grasp_figures import draw_plan
from tests.planning.hand_made import FRAME, planner


def test_the_object_displacement_is_converted_with_the_estimated_centre():
    plan = planner().plan(FRAME, np.random.default_rng(0))
    centre = centre_in_grasp_frame(plan.view.centre_base, plan.grasp.as_vector())
    assert np.allclose(plan.grasp_displacement, [0.001, 0.002, 0.0, 0.1])
    assert plan.displacement[3] == pytest.approx(-0.1)
    cos, sin = np.cos(-0.1), np.sin(-0.1)
    x, y = centre[:2] - [0.001, 0.002]
    assert np.allclose(plan.displacement[:2], np.array([cos * x - sin * y, sin * x + cos * y]) - centre[:2])


def test_a_plan_is_plain_json_and_a_picture(tmp_path):
    plan = planner().plan(FRAME, np.random.default_rng(0))
    values = json.loads(json.dumps(plan.to_json(), allow_nan=False))
    assert np.allclose(values["grasp"], plan.grasp.as_vector()) and len(values["displacement_std"]) == 4
    for number, drawn in enumerate(
        (plan, dataclasses.replace(plan, grasp_displacement_cov=np.full((4, 4), np.nan)))
    ):
        draw_plan(FRAME, drawn, tmp_path / f"{number}.png")
        assert (tmp_path / f"{number}.png").read_bytes().startswith(b"\x89PNG")
